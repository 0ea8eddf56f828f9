import { GLSL3, Matrix4, Mesh, type PerspectiveCamera, Scene, ShaderMaterial, DoubleSide, Vector3, Vector4, WebGLRenderTarget, type WebGLRenderer } from 'three';
import type { Surface } from '../mesh/surface';
import type { Layer } from './layer';

export interface Hit {
  face: number;
  /** Of the drawn mesh, the nearest one. */
  vertex: number;
  /** The ends of the nearest edge. */
  edge: [number, number];
  point: [number, number, number];
}

const kVertex = /* glsl */ `
flat out uint vertex;
out vec3 place;
void main() {
  vertex = uint(gl_VertexID) + 1u;
  place = position;
  gl_Position = projectionMatrix * modelViewMatrix * vec4(position, 1.0);
}`;
const kFragment = /* glsl */ `
uniform vec4 section;
flat in uint vertex;
in vec3 place;
out vec4 colour;
void main() {
  if (dot(section, vec4(place, 1.0)) > 0.0) discard;
  uvec4 bytes = uvec4(vertex, vertex >> 8, vertex >> 16, vertex >> 24) & 255u;
  colour = vec4(bytes) / 255.0;
}`;

/**
 * Finds what is under the pointer by drawing one pixel in which each face has the number of its last corner. Of the
 * faces with this last corner, few, the one that the ray meets is taken.
 */
export class Picker {
  private readonly target = new WebGLRenderTarget(1, 1);
  private readonly material = new ShaderMaterial({
    glslVersion: GLSL3,
    vertexShader: kVertex,
    fragmentShader: kFragment,
    side: DoubleSide,
    uniforms: { section: { value: new Vector4(0, 0, 0, -1) } },
  });
  private readonly scene = new Scene();
  private readonly pixel = new Uint8Array(4);
  private readonly faces = new WeakMap<Surface, { starts: Uint32Array; faces: Uint32Array }>();

  pick(renderer: WebGLRenderer, camera: PerspectiveCamera, layer: Layer, x: number, y: number, width: number, height: number): Hit | undefined {
    const surface = layer.surface!;
    const source = layer.group.children[0] as Mesh;
    const mesh = new Mesh(source.geometry, this.material);
    mesh.frustumCulled = false;
    mesh.position.copy(layer.group.position);
    this.scene.clear();
    this.scene.add(mesh);
    this.material.uniforms['section']!.value = layer.material.uniforms['section']!.value;
    camera.setViewOffset(width, height, Math.floor(x), Math.floor(y), 1, 1);
    renderer.setScissorTest(false);
    renderer.setRenderTarget(this.target);
    renderer.setViewport(0, 0, 1, 1);
    renderer.clear();
    renderer.render(this.scene, camera);
    renderer.readRenderTargetPixels(this.target, 0, 0, 1, 1, this.pixel);
    renderer.setRenderTarget(null);
    camera.clearViewOffset();
    const [a, b, c, d] = this.pixel;
    const corner = (a! | (b! << 8) | (c! << 16) | (d! << 24)) >>> 0;
    if (corner === 0) return undefined;
    return this.resolve(surface, corner - 1, camera, mesh.position, (x / width) * 2 - 1, 1 - (y / height) * 2);
  }

  private facesOf(surface: Surface) {
    let known = this.faces.get(surface);
    if (known) return known;
    const { index, positions } = surface;
    const starts = new Uint32Array(positions.length / 3 + 1);
    for (let f = 2; f < index.length; f += 3) ++starts[index[f]! + 1]!;
    for (let v = 1; v < starts.length; ++v) starts[v]! += starts[v - 1]!;
    const next = starts.slice();
    const faces = new Uint32Array(index.length / 3);
    for (let f = 2; f < index.length; f += 3) faces[next[index[f]!]!++] = (f - 2) / 3;
    known = { starts, faces };
    this.faces.set(surface, known);
    return known;
  }

  private resolve(surface: Surface, corner: number, camera: PerspectiveCamera, offset: Vector3, x: number, y: number): Hit | undefined {
    const { starts, faces } = this.facesOf(surface);
    const origin = camera.position.clone().sub(offset);
    const back = new Matrix4().copy(camera.projectionMatrix).invert();
    const direction = new Vector3(x, y, 0.5).applyMatrix4(back).applyMatrix4(camera.matrixWorld).sub(camera.position).normalize();
    let best: { face: number; weights: number[]; off: number; distance: number } | undefined;
    for (let k = starts[corner]!; k < starts[corner + 1]!; ++k) {
      const met = meet(surface, faces[k]!, origin, direction);
      if (!met) continue;
      const better = !best || (met.off <= 1e-6 && best.off <= 1e-6 ? met.distance < best.distance : met.off < best.off);
      if (better) best = { face: faces[k]!, ...met };
    }
    if (!best) return undefined;
    const corners = [0, 1, 2].map((k) => surface.index[3 * best.face + k]!);
    const nearest = best.weights.indexOf(Math.max(...best.weights));
    const farthest = best.weights.indexOf(Math.min(...best.weights));
    const point = origin.clone().addScaledVector(direction, best.distance);
    return {
      face: best.face,
      vertex: corners[nearest]!,
      edge: [corners[(farthest + 1) % 3]!, corners[(farthest + 2) % 3]!],
      point: [point.x, point.y, point.z],
    };
  }
}

/** The barycentric weights of where a ray meets the plane of a face, and how far outside the face that is. */
function meet(surface: Surface, face: number, origin: Vector3, direction: Vector3) {
  const [a, b, c] = [0, 1, 2].map((k) => new Vector3().fromArray(surface.positions, 3 * surface.index[3 * face + k]!));
  const ab = b!.sub(a!), ac = c!.sub(a!);
  const across = direction.clone().cross(ac);
  const det = ab.dot(across);
  if (Math.abs(det) < 1e-30) return undefined;
  const from = origin.clone().sub(a!);
  const u = from.dot(across) / det;
  const around = from.cross(ab);
  const v = direction.dot(around) / det;
  const weights = [1 - u - v, u, v];
  return { weights, off: Math.max(0, -Math.min(...weights)), distance: ac.dot(around) / det };
}
