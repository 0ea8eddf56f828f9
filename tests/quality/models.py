#!/usr/bin/env python3
"""Makes noise-free models to fit the automatic choice to: models.py FOLDER

Random parts that gmsh cuts and meshes, uniformly, by curvature, graded, or stretched into slivers; blobs and height
fields with bumps at several scales. Needs python3-gmsh and python3-numpy. The same models every time.
"""

import collections
import math
import sys

import gmsh
import numpy as np

PARTS_OF_KIND, BLOBS, SHEETS = 24, 16, 12
TURN = 2 * math.pi


# --- parts: each returns the volumes of one, and takes its measures from `random` ---


def block(occ, random):
    """A box with holes and pockets."""
    sides = [random.uniform(1, 3), random.uniform(1, 3), random.uniform(0.5, 2)]
    volumes = [(3, occ.addBox(0, 0, 0, *sides))]
    for _ in range(random.integers(1, 4)):
        axis = random.integers(0, 3)
        radius = random.uniform(0.12, 0.4) * min(sides)
        place = [random.uniform(0.2, 0.8) * side for side in sides]
        way = [0, 0, 0]
        place[axis] = -1 if random.uniform(0, 1) < 0.7 else place[axis]
        way[axis] = 6
        if random.uniform(0, 1) < 0.75:
            hole = occ.addCylinder(*place, *way, radius)
        else:
            half = random.uniform(0.2, 0.5) * min(sides)
            hole = occ.addBox(*[p - half for p in place], *[2 * half + w for w in way])
        volumes, _ = occ.cut(volumes, [(3, hole)])
    return volumes


def shaft(occ, random):
    """Cylinders and cones on one axis."""
    height, volumes = 0, []
    for _ in range(random.integers(2, 6)):
        length, radius = random.uniform(0.3, 1.5), random.uniform(0.3, 1.2)
        if random.uniform(0, 1) < 0.3:
            volumes.append((3, occ.addCone(0, 0, height, 0, 0, length, radius, random.uniform(0.2, 1.1))))
        else:
            volumes.append((3, occ.addCylinder(0, 0, height, 0, 0, length, radius)))
        height += length
    volumes, _ = occ.fuse(volumes[:1], volumes[1:])
    if random.uniform(0, 1) < 0.4:
        bore = occ.addCylinder(0, 0, -1, 0, 0, height + 2, random.uniform(0.08, 0.18))
        volumes, _ = occ.cut(volumes, [(3, bore)])
    return volumes


def tee(occ, random):
    """A tube that branches."""
    radius = random.uniform(0.4, 0.7)
    tube = occ.addCylinder(-2, 0, 0, 4, 0, 0, radius)
    branch = occ.addCylinder(0, 0, 0, random.uniform(-0.8, 0.8), 0, 2, radius * random.uniform(0.5, 0.99))
    volumes, _ = occ.fuse([(3, tube)], [(3, branch)])
    if random.uniform(0, 1) < 0.5:
        volumes, _ = occ.cut(volumes, [(3, occ.addCylinder(-3, 0, 0, 6, 0, 0, radius * 0.6))])
    return volumes


def extruded(occ, random, angles, radii, curved):
    """A star-shaped outline, pulled up."""
    count = len(angles)
    corners = [occ.addPoint(radii[i] * math.cos(angles[i]), radii[i] * math.sin(angles[i]), 0) for i in range(count)]
    lines = []
    for i in range(count):
        j = (i + 1) % count
        if curved and random.uniform(0, 1) < 0.35:
            middle = (angles[i] + (angles[j] if j else angles[0] + TURN)) / 2
            radius = (radii[i] + radii[j]) / 2 * random.uniform(0.85, 1.25)
            between = occ.addPoint(radius * math.cos(middle), radius * math.sin(middle), 0)
            lines.append(occ.addSpline([corners[i], between, corners[j]]))
        else:
            lines.append(occ.addLine(corners[i], corners[j]))
    outline = occ.addPlaneSurface([occ.addCurveLoop(lines)])
    way = random.uniform(-0.3, 0.3), random.uniform(-0.3, 0.3), random.uniform(0.4, 2)
    return [one for one in occ.extrude([(2, outline)], *way) if one[0] == 3]


def poly(occ, random):
    count = random.integers(4, 11)
    angles = np.sort((np.arange(count) + random.uniform(-0.35, 0.35, count)) * TURN / count)
    return extruded(occ, random, angles, random.uniform(0.5, 1.5, count), True)


def gear(occ, random):
    count = 2 * random.integers(6, 16)
    radii = np.where(np.arange(count) % 2 == 0, 1.0, random.uniform(0.65, 0.85))
    return extruded(occ, random, np.arange(count) * TURN / count, radii, False)


def facets(occ, random):
    """A prism over a regular polygon."""
    count = int(random.integers(6, 26))
    corners = [occ.addPoint(math.cos(TURN * i / count), math.sin(TURN * i / count), 0) for i in range(count)]
    lines = [occ.addLine(corners[i], corners[(i + 1) % count]) for i in range(count)]
    outline = occ.addPlaneSurface([occ.addCurveLoop(lines)])
    return [one for one in occ.extrude([(2, outline)], 0, 0, random.uniform(0.6, 3)) if one[0] == 3]


def revolve(occ, random):
    """A profile of lines and splines, turned about an axis, wholly or in part."""
    count = int(random.integers(3, 7))
    heights = np.cumsum(random.uniform(0.3, 1, count + 1))
    radii = random.uniform(0.3, 1.3, count + 1)
    points = [occ.addPoint(radii[i], 0, heights[i]) for i in range(count + 1)]
    bottom, top = occ.addPoint(0, 0, heights[0]), occ.addPoint(0, 0, heights[-1])
    lines, i = [occ.addLine(bottom, points[0])], 0
    while i < count:
        end = min(count, i + int(random.integers(1, 4)))
        lines.append(occ.addSpline(points[i : end + 1]) if end > i + 1 else occ.addLine(points[i], points[end]))
        i = end
    lines += [occ.addLine(points[count], top), occ.addLine(top, bottom)]
    profile = occ.addPlaneSurface([occ.addCurveLoop(lines)])
    angle = TURN if random.uniform(0, 1) < 0.6 else random.uniform(2, 5.5)
    return [one for one in occ.revolve([(2, profile)], 0, 0, 0, 0, 0, 1, angle) if one[0] == 3]


def torus(occ, random):
    """A ring joined with a box, or cut by one."""
    ring = [(3, occ.addTorus(0, 0, 0, 1, random.uniform(0.2, 0.45)))]
    y, length, width = random.uniform(-0.5, 0.2), random.uniform(1, 3), random.uniform(0.3, 1)
    bar = [(3, occ.addBox(-1.6, y, -0.6, length, width, 1.2))]
    volumes, _ = (occ.fuse if random.uniform(0, 1) < 0.5 else occ.cut)(ring, bar)
    return volumes


def ball(occ, random):
    """A ball with flats, some on a stem."""
    volumes = [(3, occ.addSphere(0, 0, 0, 1))]
    for _ in range(random.integers(1, 4)):
        axis = random.normal(size=3)
        axis /= np.linalg.norm(axis)
        box = occ.addBox(-2, -2, random.uniform(0.3, 0.8), 4, 4, 3)
        occ.rotate([(3, box)], 0, 0, 0, axis[0], axis[1], axis[2] + 0.01, random.uniform(0, 3))
        volumes, _ = occ.cut(volumes, [(3, box)])
    if random.uniform(0, 1) < 0.5:
        way = 2 * random.uniform(0.5, 1), 0, random.uniform(-1, 1)
        volumes, _ = occ.fuse(volumes, [(3, occ.addCylinder(0, 0, 0, *way, random.uniform(0.15, 0.5)))])
    return volumes


def gem(occ, random):
    """A convex polyhedron."""
    volumes = [(3, occ.addBox(-1, -1, -1, 2, 2, 2))]
    for _ in range(random.integers(4, 12)):
        normal = random.normal(size=3)
        normal /= np.linalg.norm(normal)
        box = occ.addBox(-4, -4, random.uniform(0.75, 1.15), 8, 8, 4)
        axis = np.cross([0, 0, 1], normal)
        axis /= np.linalg.norm(axis)
        occ.rotate([(3, box)], 0, 0, 0, *axis, math.acos(normal[2]))
        volumes, _ = occ.cut(volumes, [(3, box)])
    return volumes


def pipe(occ, random):
    """A disc or a square along a spline."""
    points = np.cumsum(random.normal(size=(5, 3)) * [0.5, 0.5, 0.3] + [0, 0, 0.9], axis=0)
    wire = occ.addWire([occ.addSpline([occ.addPoint(*point) for point in points])])
    radius = random.uniform(0.2, 0.35)
    if random.uniform(0, 1) < 0.5:
        section = occ.addDisk(*points[0], radius, radius)
    else:
        section = occ.addRectangle(points[0][0] - radius, points[0][1] - radius, points[0][2], 2 * radius, 2 * radius)
    return [one for one in occ.addPipe([(2, section)], wire) if one[0] == 3]


def loft(occ, random):
    """A surface through three squares that are turned and scaled."""
    loops = []
    for height in [0, random.uniform(0.6, 1.2), random.uniform(1.6, 2.6)]:
        start, radius = random.uniform(0, 0.6), random.uniform(0.5, 1.1)
        corners = [
            occ.addPoint(radius * math.cos(start + TURN * i / 4), radius * math.sin(start + TURN * i / 4), height)
            for i in range(4)
        ]
        loops.append(occ.addCurveLoop([occ.addLine(corners[i], corners[(i + 1) % 4]) for i in range(4)]))
    volumes = occ.addThruSections(loops, makeSolid=True, makeRuled=bool(random.uniform(0, 1) < 0.4))
    return [one for one in volumes if one[0] == 3]


def fillet(occ, random):
    """A box, some with a hole, with some of its edges rounded."""
    sides = random.uniform(1, 3), random.uniform(1, 2), random.uniform(0.8, 2)
    volumes = [(3, occ.addBox(0, 0, 0, *sides))]
    if random.uniform(0, 1) < 0.5:
        hole = occ.addCylinder(sides[0] / 2, sides[1] / 2, -1, 0, 0, 5, 0.25 * min(sides[:2]))
        volumes, _ = occ.cut(volumes, [(3, hole)])
    occ.synchronize()
    faces = [abs(face[1]) for face in gmsh.model.getBoundary(volumes, combined=False, recursive=False)]
    edges = sorted({abs(e[1]) for face in faces for e in gmsh.model.getBoundary([(2, face)], oriented=False)})
    edges = [edge for edge in edges if random.uniform(0, 1) < 0.4] or edges[:1]
    return occ.fillet([volumes[0][1]], edges, [random.uniform(0.08, 0.25) * min(sides)])


KINDS = [block, shaft, tee, poly, gear, facets, revolve, torus, ball, gem, pipe, loft, fillet]


# --- meshes ---


def set_mesh_size(random, size):
    """Returns how the part is to be meshed: uniformly, by curvature, graded, or stretched."""
    set_number = gmsh.option.setNumber
    set_number("Mesh.MeshSizeExtendFromBoundary", 1)
    set_number("Mesh.MeshSizeFromCurvature", 0)
    set_number("Mesh.MeshSizeMin", 0)
    set_number("Mesh.MeshSizeMax", size)
    set_number("Mesh.Algorithm", int(random.choice([1, 5, 6, 6, 6, 5])))
    mode = random.choice(["uniform", "uniform", "uniform", "curvature", "graded", "stretched"])
    if mode == "curvature":
        set_number("Mesh.MeshSizeMax", 2.2 * size)
        set_number("Mesh.MeshSizeFromCurvature", int(random.integers(16, 40)))
    if mode == "graded":
        set_number("Mesh.MeshSizeMax", 1e22)
        set_number("Mesh.MeshSizeExtendFromBoundary", 0)
        box = gmsh.model.getBoundingBox(-1, -1)
        axis = int(random.integers(0, 3))
        low, high, growth = box[axis], box[axis + 3], random.uniform(1.2, 1.8)
        field = gmsh.model.mesh.field.add("MathEval")
        share = f"(2*({'xyz'[axis]}-({low}))/({high - low})-1)"
        gmsh.model.mesh.field.setString(field, "F", f"{size}*Exp({growth}*{share}*0.7)")
        gmsh.model.mesh.field.setAsBackgroundMesh(field)
    return mode


def meshed():
    """Points and triangles of the current model, which is removed."""
    gmsh.model.mesh.generate(2)
    tags, points, _ = gmsh.model.mesh.getNodes()
    place = {tag: i for i, tag in enumerate(tags)}
    triangles = []
    for kind, _, nodes in zip(*gmsh.model.mesh.getElements(2)):
        if kind == 2:
            triangles += [place[node] for node in nodes]
    gmsh.model.remove()
    used, triangles = np.unique(np.array(triangles), return_inverse=True)
    return np.array(points).reshape(-1, 3)[used], triangles.reshape(-1, 3)


def wound_alike(triangles):
    """The triangles, turned so that neighbours agree."""
    triangles = [list(triangle) for triangle in triangles]
    edges = collections.defaultdict(list)
    for i, triangle in enumerate(triangles):
        for k in range(3):
            edges[frozenset((triangle[k], triangle[(k + 1) % 3]))].append(i)
    seen = [False] * len(triangles)
    for start in range(len(triangles)):
        waiting = [] if seen[start] else [start]
        seen[start] = True
        while waiting:
            triangle = triangles[waiting.pop()]
            for k in range(3):
                a, b = triangle[k], triangle[(k + 1) % 3]
                for j in edges[frozenset((a, b))]:
                    if seen[j]:
                        continue
                    other = triangles[j]
                    if any(other[q] == a and other[(q + 1) % 3] == b for q in range(3)):
                        other[1], other[2] = other[2], other[1]
                    seen[j] = True
                    waiting.append(j)
    return np.array(triangles)


def save(path, points, triangles):
    triangles = wound_alike(triangles)
    a, b, c = (points[triangles[:, k]] for k in range(3))
    if np.einsum("ij,ij->i", a, np.cross(b, c)).sum() < 0:
        triangles = triangles[:, ::-1]
    with open(path, "w", encoding="ascii") as file:
        file.write(f"OFF\n{len(points)} {len(triangles)} 0\n")
        file.writelines("%.9g %.9g %.9g\n" % tuple(point) for point in points)
        file.writelines("3 %d %d %d\n" % tuple(triangle) for triangle in triangles)


def make_part(path, kind, random):
    most_faces, fewest_points = 25_000, 100
    gmsh.model.add(path)
    kind(gmsh.model.occ, random)
    gmsh.model.occ.synchronize()
    area = sum(gmsh.model.occ.getMass(2, tag) for _, tag in gmsh.model.getEntities(2))
    faces = math.exp(random.uniform(math.log(1200), math.log(9000)))
    mode = set_mesh_size(random, math.sqrt(area / faces * 4 / math.sqrt(3)))
    points, triangles = meshed()
    if mode == "stretched":
        points = points * np.array([random.uniform(2, 5), 1, 1])
    if len(triangles) > most_faces or len(points) < fewest_points:
        raise ValueError(f"{len(triangles)} faces")
    save(path, points, triangles)


# --- surfaces that are curved all over ---


def bumps(points, random, slope, smallest, largest, count):
    """Heights of hills and cones at random places, by `slope` as high as they are wide."""
    heights = np.zeros(len(points))
    for _ in range(count):
        width = math.exp(random.uniform(math.log(smallest), math.log(largest)))
        centre = points[random.integers(len(points))]
        height = random.normal() * width * slope
        squares = ((points - centre) ** 2).sum(1) / width / width
        hill = random.uniform() < 0.7
        heights += height * (np.exp(-squares / 2) if hill else np.maximum(0, 1 - np.sqrt(squares)))
    return heights


def make_blob(path, random):
    """A twisted ball with bumps."""
    faces = math.exp(random.uniform(math.log(1500), math.log(12000)))
    gmsh.model.add(path)
    gmsh.model.occ.addSphere(0, 0, 0, 1)
    gmsh.model.occ.synchronize()
    gmsh.option.setNumber("Mesh.MeshSizeMax", math.sqrt(2 * TURN / faces * 4 / math.sqrt(3)))
    gmsh.option.setNumber("Mesh.MeshSizeFromCurvature", 0)
    gmsh.option.setNumber("Mesh.Algorithm", int(random.choice([1, 5, 6])))
    points, triangles = meshed()
    edge = math.sqrt(2 * TURN / len(triangles) * 2.3)
    axes = random.uniform(0.6, 1.8, 3)
    heights = 0.8 * bumps(points, random, 0.4, 0.3, 1, 10)
    heights += bumps(points, random, random.uniform(0.1, 0.5), 2 * edge, 0.3, int(random.integers(10, 200)))
    points = points * axes * (1 + np.clip(heights, -0.7, 1.5))[:, None]
    twist = random.uniform(0, 1) * points[:, 2]
    x, y = points[:, 0].copy(), points[:, 1].copy()
    points[:, 0], points[:, 1] = np.cos(twist) * x - np.sin(twist) * y, np.sin(twist) * x + np.cos(twist) * y
    save(path, points, triangles)


def sheet_heights(x, y, random, spacing):
    places = np.stack([x.ravel(), y.ravel(), 0 * x.ravel()], 1)
    slope, count = random.uniform(0.2, 0.6), int(random.integers(5, 120))
    heights = bumps(places, random, slope, 2.5 * spacing, 0.4, count).reshape(x.shape)
    for _ in range(random.integers(0, 4)):
        centre, radius = random.uniform(0, 1, 2), random.uniform(0.1, 0.3)
        if random.uniform() < 0.5:
            dome = np.sqrt(np.maximum(0, radius * radius - (x - centre[0]) ** 2 - (y - centre[1]) ** 2))
            object_on_it = dome * random.uniform(0.5, 1)
        else:
            inside = radius - np.maximum(abs(x - centre[0]), abs(y - centre[1]))
            object_on_it = np.clip(inside * random.uniform(1, 3), 0, 0.1)
        heights = np.maximum(heights, object_on_it + heights * random.uniform(0, 1))
    return heights


def make_sheet(path, random):
    """A height field, as a depth camera sees it: bumps, domes and frustums."""
    columns = int(random.integers(30, 80))
    rows = int(columns * random.uniform(0.7, 1.3))
    spacing = 1 / columns
    x, y = np.meshgrid(np.linspace(0, 1, columns), np.linspace(0, rows / columns, rows))
    x = x + random.uniform(-0.25, 0.25, x.shape) * spacing * (random.uniform() < 0.5)
    points = np.stack([x.ravel(), y.ravel(), sheet_heights(x, y, random, spacing).ravel()], 1)
    triangles = []
    for row in range(rows - 1):
        for column in range(columns - 1):
            a = row * columns + column
            b, c, d = a + 1, a + columns, a + columns + 1
            if np.linalg.norm(points[a] - points[d]) < np.linalg.norm(points[b] - points[c]):
                triangles += [[a, b, d], [a, d, c]]
            else:
                triangles += [[a, b, c], [b, d, c]]
    save(path, points, np.array(triangles))


def main(folder):
    gmsh.initialize()
    gmsh.option.setNumber("General.Terminal", 0)
    for number, kind in enumerate(KINDS):
        for i in range(PARTS_OF_KIND):
            path = f"{folder}/{kind.__name__}_{i}.off"
            try:
                make_part(path, kind, np.random.default_rng(hash((number, i)) % 2**31))
            except Exception as error:  # gmsh raises nothing narrower where a shape cannot be cut or meshed
                print(f"{path} is left out: {error}", file=sys.stderr)
                gmsh.clear()
    for i in range(BLOBS):
        make_blob(f"{folder}/blob{i}_0.off", np.random.default_rng(1000 + i))
    for i in range(SHEETS):
        make_sheet(f"{folder}/sheet{i}_0.off", np.random.default_rng(2000 + i))


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    main(sys.argv[1])
