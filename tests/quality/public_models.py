#!/usr/bin/env python3
"""Makes noise-free models to fit the automatic choice to, from public ones: public_models.py FOLDER CHECKOUTS

CHECKOUTS holds a folder for each of REPOSITORIES, all of them on GitHub. Their parts are meshed anew, the largest two
solids of each; their meshes are taken as they are and decimated. FOLDER/small and FOLDER/large take the results. Those
named alike but for what follows the last underscore are a family. Needs python3-gmsh, python3-numpy, python3-scipy and python3-vtk9. The same models every time.
"""

import concurrent.futures
import math
import multiprocessing
import pathlib
import re
import sys
import zlib

import gmsh
import models
import numpy as np
import vtk
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components
from vtk.util.numpy_support import numpy_to_vtk, numpy_to_vtkIdTypeArray, vtk_to_numpy

REPOSITORIES = [
    "alecjacobson/common-3d-test-models",
    "libigl/libigl-tutorial-data",
    "mikedh/trimesh",
    "mlivesu/cinolib",
    "odedstein/meshes",
    "prusa3d/Original-Prusa-MINI",
    "prusa3d/Original-Prusa-i3",
    "tpaviot/pythonocc-demos",
]
# Those of held-out or development pairs, under any name, and what has no shape.
LEFT_OUT = {"homer", "camel", "camelhead", "cheese", "armadillo"} | {"circle", "plane", "hele", "two"}
MESHES_OF_TRIMESH = {"cycloidal", "chair_model", "capsule", "rabbit", "quadknot", "fuze"}
FAMILIES = {"stanford": "bunny"}
FEWEST, MOST, MOST_OF_LARGE = 800, 22_000, 200_000
TIMEOUT_S = 90


def random_for(name):
    return np.random.default_rng(zlib.crc32(name.encode()))


def faces_between(fewest, most, random):
    return math.exp(random.uniform(math.log(fewest), math.log(most)))


# --- parts ---


def make_part(source, path, name, variant):
    """Meshes the largest solid of a STEP file, or for variant 1 the second largest."""
    random = random_for(name + str(variant))
    gmsh.initialize()
    gmsh.option.setNumber("General.Terminal", 0)
    gmsh.model.add(name)
    occ = gmsh.model.occ
    solids = [entity for entity in occ.importShapes(str(source)) if entity[0] == 3]
    occ.synchronize()

    def area_of(solid):
        return sum(occ.getMass(2, abs(tag)) for _, tag in gmsh.model.getBoundary([solid], oriented=False))

    solids.sort(key=area_of, reverse=True)
    solid = solids[variant % min(2, len(solids))]
    area = area_of(solid)
    others = [other for other in solids if other != solid]
    if others:
        occ.remove(others, recursive=True)
        occ.synchronize()
    models.set_mesh_size(random, math.sqrt(area / faces_between(2500, 17000, random) * 4 / math.sqrt(3)))
    save(path, *models.meshed(), MOST)


# --- meshes ---


def read_off(source):
    words = iter(source.read_text().split())
    next(words)
    vertices, faces, _ = (int(next(words)) for _ in range(3))
    points = np.array([float(next(words)) for _ in range(3 * vertices)]).reshape(-1, 3)
    triangles = []
    for _ in range(faces):
        corners = [int(next(words)) for _ in range(int(next(words)))]
        triangles += [[corners[0], corners[i], corners[i + 1]] for i in range(1, len(corners) - 1)]
    data = vtk.vtkPolyData()
    data.SetPoints(vtk.vtkPoints())
    data.GetPoints().SetData(numpy_to_vtk(points, deep=True))
    cells = vtk.vtkCellArray()
    flat = np.column_stack([np.full(len(triangles), 3), triangles]).astype(np.int64).ravel()
    cells.SetCells(len(triangles), numpy_to_vtkIdTypeArray(flat, deep=True))
    data.SetPolys(cells)
    return data


def read(source):
    if source.suffix == ".off":
        return read_off(source)
    reader = {".obj": vtk.vtkOBJReader, ".ply": vtk.vtkPLYReader}[source.suffix]()
    reader.SetFileName(str(source))
    reader.Update()
    return reader.GetOutput()


def cleaned(data):
    """Triangles alone, with points of the same place merged."""
    faces = vtk.vtkPolyData()
    faces.SetPoints(data.GetPoints())
    faces.SetPolys(data.GetPolys())
    triangles = vtk.vtkTriangleFilter()
    triangles.SetInputData(faces)
    triangles.PassLinesOff()
    triangles.PassVertsOff()
    merged = vtk.vtkCleanPolyData()
    merged.SetInputConnection(triangles.GetOutputPort())
    merged.SetTolerance(1e-7)
    merged.Update()
    return merged.GetOutput()


def decimated(data, faces):
    decimation = vtk.vtkQuadricDecimation()
    decimation.SetInputData(data)
    decimation.SetTargetReduction(1 - faces / data.GetNumberOfPolys())
    decimation.VolumePreservationOn()
    decimation.Update()
    return cleaned(decimation.GetOutput())


def renumbered(points, triangles):
    used, triangles = np.unique(triangles, return_inverse=True)
    return points[used], triangles.reshape(-1, 3)


def arrays_of(data):
    """Points and triangles, without those of no area."""
    points = vtk_to_numpy(data.GetPoints().GetData()).astype(float)
    triangles = vtk_to_numpy(data.GetPolys().GetData()).reshape(-1, 4)[:, 1:]
    a, b, c = (triangles[:, k] for k in range(3))
    triangles = triangles[(a != b) & (b != c) & (a != c)]
    a, b, c = (points[triangles[:, k]] for k in range(3))
    return renumbered(points, triangles[np.linalg.norm(np.cross(b - a, c - a), axis=1) > 0])


def large_components(points, triangles):
    fewest = 200
    rows, columns = triangles[:, :2].ravel(), triangles[:, 1:].ravel()
    graph = coo_matrix((np.ones(len(rows)), (rows, columns)), (len(points), len(points)))
    count, labels = connected_components(graph, directed=False)
    of_triangle = labels[triangles[:, 0]]
    sizes = np.bincount(of_triangle, minlength=count)
    return renumbered(points, triangles[sizes[of_triangle] >= fewest])


def make_mesh(source, path, name, variant):
    """Takes a mesh as it is for variant 0, if it is small, and for variant 2, if it is large, or else decimates it."""
    random = random_for(name + str(variant))
    data = cleaned(read(source))
    count = data.GetNumberOfPolys()
    if variant == 2 and count < 24_000 or count < 900:
        raise ValueError(f"{count} faces")
    if variant == 1 or variant == 0 and count > 20_000:
        faces = faces_between(2500, max(2600, min(18_000, 0.6 * count)), random)
        if count < 1.5 * faces:
            raise ValueError(f"{count} faces are too few to decimate")
        data = decimated(data, faces)
    save(path, *large_components(*arrays_of(data)), MOST_OF_LARGE if variant == 2 else MOST)


def save(path, points, triangles, most):
    if not FEWEST < len(triangles) < most:
        raise ValueError(f"{len(triangles)} faces")
    models.save(path, points, triangles)


# --- all of them ---


def jobs_of(folder, checkouts):
    for repository in REPOSITORIES:
        root = pathlib.Path(checkouts) / repository.split("/")[1]
        for source in sorted(root.rglob("*")):
            kind = source.suffix.lower()
            word = re.sub("[^a-z0-9]", "", re.split("[-_. ]", source.stem.removeprefix("MINI-"))[0].lower())
            tag = re.sub("[^a-z0-9]", "", source.stem.lower())
            if word in LEFT_OUT or "control" in source.stem:
                continue
            if kind in (".step", ".stp"):
                make, word, variants = make_part, "step-" + word, [0, 1]
            elif kind in (".obj", ".off", ".ply") and "prusa3d" not in repository:
                if "trimesh" in repository and source.stem not in MESHES_OF_TRIMESH:
                    continue
                make, tag, variants = make_mesh, repository[:3] + tag, [0, 1, 2]
            else:
                continue
            for variant in variants:
                family, size = FAMILIES.get(word, word), "large" if variant == 2 else "small"
                path = f"{folder}/{size}/{family}_{tag}{variant}.off"
                yield make, source, path, f"{word}_{tag}{variant}.off", variant


def run(job):
    make, *arguments = job
    process = multiprocessing.Process(target=make, args=arguments)
    process.start()
    process.join(TIMEOUT_S)
    if process.is_alive():
        process.kill()
    if process.exitcode != 0:
        print(f"{arguments[1]} is left out", file=sys.stderr)


def main(folder, checkouts):
    for size in ("small", "large"):
        pathlib.Path(folder, size).mkdir(parents=True, exist_ok=True)
    with concurrent.futures.ThreadPoolExecutor() as pool:
        list(pool.map(run, jobs_of(folder, checkouts)))


if __name__ == "__main__":
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    main(*sys.argv[1:])
