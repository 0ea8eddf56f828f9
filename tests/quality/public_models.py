#!/usr/bin/env python3
"""Makes noise-free models to fit the automatic choice to, from public ones: public_models.py FOLDER CHECKOUTS REMESH

CHECKOUTS holds a folder for each of the repositories below, all of them on GitHub; REMESH is the program of remesh.cpp
(`cmake --build --preset release --target remesh`). Solids are meshed anew, the largest two of each file. Meshes are
taken as they are, decimated, and meshed anew. Parts that come as triangles, a few of each folder, are meshed anew
between their creases. FOLDER/small and FOLDER/large take the results. Those named alike but for what follows the last
underscore are a family. Needs python3-gmsh, python3-numpy, python3-scipy and python3-vtk9. The same models every time.
"""

import concurrent.futures
import math
import multiprocessing
import pathlib
import re
import subprocess
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
    "pmp-library/pmp-library",
    "prusa3d/Original-Prusa-MINI",
    "prusa3d/Original-Prusa-i3",
    "pyvista/vtk-data",
    "tpaviot/pythonocc-demos",
]
REPOSITORIES_OF_PARTS = [
    "EtteGit/EnragedRabbitProject",
    "Gepetto/example-robot-data",
    "Open-Cascade-SAS/OCCT",
    "ROBOTIS-GIT/turtlebot3",
    "TheRobotStudio/SO-ARM100",
    "VoronDesign/Voron-0",
    "VoronDesign/Voron-Afterburner",
    "VoronDesign/Voron-Stealthburner",
    "VoronDesign/Voron-Trident",
    "poppy-project/poppy-humanoid",
    "robotology/icub-models",
    "ros-industrial/abb",
    "ros-industrial/fanuc",
    "ros-industrial/motoman",
    "ros-industrial/universal_robot",
    "unitreerobotics/unitree_ros",
]
# Those of held-out or development pairs, under any name, and what has no shape.
LEFT_OUT = {"homer", "camel", "camelhead", "cheese", "armadillo", "shark", "turbineblade"}
LEFT_OUT |= {"circle", "plane", "hele", "two"}
MESHES_OF_TRIMESH = {"cycloidal", "chair_model", "capsule", "rabbit", "quadknot", "fuze"}
FAMILIES = {"stanford": "bunny"}
FEWEST, MOST, MOST_OF_LARGE = 800, 50_000, 200_000
MOST_OF_FOLDER = 3  # parts that come as triangles
TIMEOUT_S = 45


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


# --- triangles meshed anew ---


def remesh(kind, source, path, name, fewest, most):
    faces = faces_between(fewest, most, random_for(name))
    subprocess.run([REMESH, kind, source, path, str(faces), str(zlib.crc32(name.encode()))], check=True)


def make_remeshed_part(source, path, name, variant):
    remesh("part", source, path, name, 2500, 17_000)


def make_remeshed_mesh(source, path, name, variant):
    """Of what make_mesh has made."""
    count = int(pathlib.Path(source).read_text().split(maxsplit=3)[2])
    if count < 5000:
        raise ValueError(f"{count} faces")
    remesh("organic", source, path, name, 3000, min(40_000, 0.9 * count))


# --- all of them ---


def word_of(source):
    return re.sub("[^a-z0-9]", "", re.split("[-_. ]", source.stem.removeprefix("MINI-"))[0].lower())


def tag_of(text):
    return re.sub("[^a-z0-9]", "", text.lower())


def job_of(folder, make, source, family, tag, variant):
    size = "large" if variant == 2 else "small"
    name = f"{tag}{variant}.off"
    return make, source, f"{folder}/{size}/{FAMILIES.get(family, family)}_{name}", f"{family}_{name}", variant


def jobs_of(folder, checkouts):
    for repository in REPOSITORIES + REPOSITORIES_OF_PARTS:
        root = pathlib.Path(checkouts) / repository.split("/")[1]
        for source in sorted(root.rglob("*")):
            kind, word = source.suffix.lower(), word_of(source)
            if word in LEFT_OUT or "control" in source.stem:
                continue
            if kind in (".step", ".stp"):
                for variant in (0, 1):
                    yield job_of(folder, make_part, source, "step-" + word, tag_of(source.stem), variant)
            elif kind in (".obj", ".off", ".ply") and repository in REPOSITORIES and "prusa3d" not in repository:
                if "trimesh" in repository and source.stem not in MESHES_OF_TRIMESH:
                    continue
                for variant in (0, 1, 2):
                    yield job_of(folder, make_mesh, source, word, repository[:3] + tag_of(source.stem), variant)


def remeshing_jobs_of(folder, checkouts):
    for make, _, path, *_ in jobs_of(folder, checkouts):
        if make is make_mesh and pathlib.Path(path).exists():
            family, tag = pathlib.Path(path).stem.rsplit("_", 1)
            yield job_of(folder, make_remeshed_mesh, path, family, tag + "-anew", 0)
    for repository in REPOSITORIES_OF_PARTS:
        root, of_folder = pathlib.Path(checkouts) / repository.split("/")[1], {}
        for source in root.rglob("*"):
            if source.suffix.lower() == ".stl" and "collision" not in str(source).lower():  # those are mere hulls
                of_folder.setdefault(source.parent, []).append(source)
        for parent, sources in sorted(of_folder.items()):
            sources.sort(key=lambda source: zlib.crc32(source.name.encode()))
            family = "stl-" + tag_of(root.name + str(parent.relative_to(root)))
            for source in sources[:MOST_OF_FOLDER]:
                yield job_of(folder, make_remeshed_part, source, family, tag_of(source.stem), 0)


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
        list(pool.map(run, remeshing_jobs_of(folder, checkouts)))


if __name__ == "__main__":
    if len(sys.argv) != 4:
        sys.exit(__doc__)
    REMESH = sys.argv[3]
    main(*sys.argv[1:3])
