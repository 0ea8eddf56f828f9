import { Color, DataTexture, DoubleSide, GLSL3, LinearFilter, NearestFilter, ShaderMaterial, Vector2, Vector4 } from 'three';

/** Where a colouring gets its colours from, and how its numbers are put on them. */
export interface Colouring {
  values: Float32Array;
  range: [number, number];
  scale: 'sequential' | 'diverging' | 'classes';
}

const kVertex = /* glsl */ `
in float value;
out vec3 eye;
out vec3 direction;
out vec3 place;
out float smoothValue;
flat out float flatValue;
void main() {
  place = position;
  vec4 seen = modelViewMatrix * vec4(position, 1.0);
  eye = seen.xyz;
  direction = normalMatrix * normal;
  smoothValue = value;
  flatValue = value;
  gl_Position = projectionMatrix * seen;
}`;

const kFragment = /* glsl */ `
uniform vec3 clay;
uniform vec3 inside;
uniform bool facets;
uniform bool coloured;
uniform bool classes;
uniform sampler2D colours;
uniform vec2 range;
uniform vec2 chosen;
uniform vec4 section;
uniform float opacity;
in vec3 eye;
in vec3 direction;
in vec3 place;
in float smoothValue;
flat in float flatValue;
out vec4 colour;

vec3 toLinear(vec3 c) { return pow(c, vec3(2.2)); }

void main() {
  if (dot(section, vec4(place, 1.0)) > 0.0) discard;
  vec3 n = normalize(direction);
  if (facets || dot(direction, direction) < 1e-12) n = normalize(cross(dFdx(eye), dFdy(eye)));
  vec3 v = normalize(-eye);
  bool back = !gl_FrontFacing;
  float towards = dot(n, v);
  // At folds a smooth normal may turn away where its face does not, and a sample of what lies behind may come through:
  // both take the normal of the silhouette, so that no dark speck is left of them.
  n = back && towards < -0.1 ? -n : normalize(n - min(towards, 0.0) * v);
  vec3 base = toLinear(clay);
  if (coloured) {
    float x = classes ? flatValue : smoothValue;
    vec3 mapped = classes ? texture(colours, vec2((mod(x, 64.0) + 0.5) / 64.0, 0.5)).rgb
                          : texture(colours, vec2(clamp((x - range.x) / max(range.y - range.x, 1e-20), 0.003, 0.997), 0.5)).rgb;
    bool shown = x >= chosen.x && x <= chosen.y && !(classes && x < 0.0);
    base = shown ? toLinear(mapped) : mix(base, vec3(dot(base, vec3(0.33))), 0.6) * 0.8;
  }
  // A mesh may be wound inside out; only a cut shows what is inside. At a silhouette it would only be a dotted rim.
  if (back && towards < -0.1 && section.xyz != vec3(0.0)) base = toLinear(inside);
  vec3 key = normalize(vec3(-0.45, 0.65, 0.62));
  vec3 fill = normalize(vec3(0.75, 0.05, 0.55));
  float wrap = max(0.0, dot(n, key) * 0.85 + 0.15);
  float light = 0.78 * wrap + 0.20 * max(0.0, dot(n, fill)) + 0.16 + 0.10 * n.y;
  vec3 h = normalize(key + v);
  float shine = back ? 0.0 : 0.13 * pow(max(dot(n, h), 0.0), 38.0);
  float edge = pow(1.0 - max(dot(n, v), 0.0), 3.0);
  vec3 lit = base * light * (1.0 - 0.30 * edge) + vec3(shine);
  colour = vec4(pow(clamp(lit, 0.0, 1.0), vec3(1.0 / 2.2)), opacity);
}`;

const kSequential = ['#2b2145', '#3a3a7c', '#2f6690', '#2a8f8f', '#54b576', '#b3cf57', '#f7e26b'];
const kDiverging = ['#1f4e9c', '#5b93cf', '#b7d3ea', '#f1efe9', '#f2c3a0', '#d97a4a', '#a33317'];
const kClasses = ['#c9c2b6', '#d9512c', '#2f6690'];

/** The colours of a scale, from low to high, as CSS. */
export const coloursOf = (scale: Colouring['scale']): string[] =>
  scale === 'classes' ? kClasses : scale === 'diverging' ? kDiverging : kSequential;

/** A colour for each of many segments; neighbours in number are far apart in hue. */
export function segmentColour(segment: number): string {
  const hue = (segment * 137.508) % 360;
  return `hsl(${hue.toFixed(0)} ${42 + ((segment * 29) % 24)}% ${56 + ((segment * 17) % 16)}%)`;
}

function ramp(stops: string[], size: number): DataTexture {
  const bytes = new Uint8Array(4 * size);
  const colours = stops.map((stop) => new Color().setStyle(stop, 'srgb-linear'));
  for (let i = 0; i < size; ++i) {
    const at = (i / (size - 1)) * (stops.length - 1);
    const low = Math.min(Math.floor(at), stops.length - 2);
    const mixed = colours[low]!.clone().lerp(colours[low + 1]!, at - low);
    bytes.set([255 * mixed.r, 255 * mixed.g, 255 * mixed.b, 255], 4 * i);
  }
  const texture = new DataTexture(bytes, size, 1);
  texture.magFilter = texture.minFilter = LinearFilter;
  texture.needsUpdate = true;
  return texture;
}

function palette(): DataTexture {
  const bytes = new Uint8Array(4 * 64);
  const colour = new Color();
  for (let i = 0; i < 64; ++i) {
    colour.setStyle(i < 0 ? '#999' : segmentColour(i).replaceAll(' ', ','), 'srgb-linear');
    bytes.set([255 * colour.r, 255 * colour.g, 255 * colour.b, 255], 4 * i);
  }
  const texture = new DataTexture(bytes, 64, 1);
  texture.magFilter = texture.minFilter = NearestFilter;
  texture.needsUpdate = true;
  return texture;
}

const textures = new Map<string, DataTexture>();
function textureOf(name: string): DataTexture {
  let texture = textures.get(name);
  if (!texture) {
    texture = name === 'segments' ? palette() : ramp(name === 'diverging' ? kDiverging : kSequential, 256);
    textures.set(name, texture);
  }
  return texture;
}

/** Matte clay with a soft light from the left, or the colours of a number at each vertex. */
export class SurfaceMaterial extends ShaderMaterial {
  constructor() {
    super({
      glslVersion: GLSL3,
      vertexShader: kVertex,
      fragmentShader: kFragment,
      side: DoubleSide,
      uniforms: {
        clay: { value: new Color('#d6cfc3') },
        inside: { value: new Color('#8a5a4a') },
        facets: { value: false },
        coloured: { value: false },
        classes: { value: false },
        colours: { value: textureOf('sequential') },
        range: { value: new Vector2(0, 1) },
        chosen: { value: new Vector2(-1e30, 1e30) },
        section: { value: new Vector4(0, 0, 0, -1) },
        opacity: { value: 1 },
      },
    });
  }

  private of<T>(name: string): T {
    return this.uniforms[name]!.value as T;
  }

  set facets(on: boolean) {
    this.uniforms['facets']!.value = on;
  }
  setClay(clay: string, inside: string): void {
    this.of<Color>('clay').setStyle(clay, 'srgb-linear');
    this.of<Color>('inside').setStyle(inside, 'srgb-linear');
  }
  setColouring(colouring?: Pick<Colouring, 'range' | 'scale'>): void {
    this.uniforms['coloured']!.value = colouring !== undefined;
    if (!colouring) return;
    this.uniforms['classes']!.value = colouring.scale === 'classes';
    this.uniforms['colours']!.value = textureOf(colouring.scale === 'classes' ? 'segments' : colouring.scale);
    this.of<Vector2>('range').set(...colouring.range);
    this.choose();
  }
  /** Shows only the numbers in a range in colour. */
  choose(range?: [number, number]): void {
    this.of<Vector2>('chosen').set(...(range ?? [-1e30, 1e30]));
  }
  get section(): readonly number[] {
    return this.of<Vector4>('section').toArray();
  }
  setSection(plane: [number, number, number, number]): void {
    this.of<Vector4>('section').set(...plane);
  }
}
