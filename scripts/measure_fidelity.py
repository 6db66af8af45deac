#!/usr/bin/python3 -B
# SPDX-License-Identifier: Apache-2.0
"""Bakes assets 512^3 to 8^3, evaluates every level under every light, also against meshoptimizer's meshes of the same bytes,
and writes docs/results/fidelity.md.

Usage: nice nohup scripts/measure_fidelity.py FOLDER ['FILE*'...] [--only NAME...] [--list] [--views N] [--page FILE]

The assets: every mesh of ../shared/assets, those of scripts/make_fidelity_assets.py, and FILEs beside them; with * behind it
(quoted, for the shell), one that was looked at while tuning. --only: those of these names (--list shows them). Parts that
FOLDER has of this very program are not measured again, so that an interrupted run goes on where it stopped. Needs the release
build; meshes need libmeshoptimizer-dev and the target simplified_levels.
"""
import argparse
import hashlib
import json
import resource
import shutil
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT / "scripts"))
import make_fidelity_assets
from fidelity_page import Figures, page

FARFIELD = ROOT / "build/release/bin/farfield"
SIMPLIFIED_LEVELS = ROOT / "build/release/bin/simplified_levels"
SHARED = ROOT.parent / "shared/assets"
SIMPLIFIED_LIGHT = "daylight"  # all five would take as long again as our own levels, twice

# Of the shared assets; * as on the command line, # a mesh of a glTF.
SHARED_ASSETS = ["trees/small_maple.obj.gz*", "trees/small_maple_cards.glb*", "trees/small_maple.glb.gz*", "trees/small_maple.ply.gz",
                 "meshes/stanford-bunny.obj.gz*", "meshes/suzanne_cc2.obj.gz*", "meshes/spot/spot_quadrangulated.obj",
                 "meshes/spot/spot_control_mesh.obj", "forest/forest_pullback.glb#0", "forest/forest_pullback.glb#1",
                 "forest/forest_pullback.glb#2", "forest/forest_pullback.glb#3", "gltf-import/glTF-Transform/Box.glb",
                 "gltf-import/glTF-Transform/BoxVertexColors.glb", "gltf-import/glTF-Transform/TwoCubes.glb",
                 "gltf-import/glTF-Transform/ShapeCollection.glb",
                 "gltf-import/tinygltf/CubeImageUriSpaces/CubeImageUriSpaces.gltf",
                 "gltf-import/tinygltf/SparseMorphTargets-issue280/singleBlendshapeCube_sparse.glb"]
# Of the generated ones, those that were looked at while walls were made (decisions 0014 and 0031).
LOOKED_AT = ["tiles", "feathers", "planks_50", "fence", "ropes"]
LEFT_OUT = [("nasty/, tinygltf/BoundsChecking and tinygltf/regression", "broken on purpose or without faces; tests read them"),
            ("import-cases/", "a few triangles per trait of exporters; tests read them"),
            ("glTF-Transform/BoxDraco, BoxMeshopt, DenseSphere, DracoSparseMesh",
             "compressed by extensions that Farfield refuses by name"),
            ("glTF-Transform/Box.gltf", "the same box as Box.glb"),
            ("volumes/", "clouds, no meshes"),
            ("the forest as a whole", "docs/results/forest.md; its meshes are here")]


class Asset:
    def __init__(self, text, name=None):
        text, self.is_tuned = text.rstrip("*"), text.endswith("*")
        path, _, mesh = text.partition("#")
        self.source = Path(path)
        self.mesh = ["--mesh", mesh] if mesh else []
        self.name = name or self.source.name.replace(".gz", "").replace(".", "_") + ("_mesh_" + mesh if mesh else "")


def all_assets(files, generated):
    texts = ["%s/%s" % (SHARED, text) for text in SHARED_ASSETS if (SHARED / text.rstrip("*").partition("#")[0]).exists()]
    return ([Asset(text) for text in [*texts, *files]] +
            [Asset("%s/%s.glb%s" % (generated, name, "*" if name in LOOKED_AT else ""), name)
             for name in make_fidelity_assets.ASSETS])


def run(*command):
    done = subprocess.run([str(word) for word in command], stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
    if done.returncode != 0:
        raise RuntimeError((done.stderr.strip().splitlines() or ["exit code %d" % done.returncode])[-1])


def cpu_seconds(*command):
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    run(*command)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def program_key(*programs):
    digest = hashlib.sha256()
    for program in programs:
        digest.update(program.read_bytes())
    return digest.hexdigest()[:12]


def bake(asset, folder):
    """CPU seconds."""
    seconds, baked = folder / (asset.name + ".cpu"), folder / (asset.name + ".farfield")
    if not seconds.exists():
        shutil.rmtree(baked, ignore_errors=True)  # half a bake would resume, in fewer seconds than a whole one
        seconds.write_text("%f" % cpu_seconds(FARFIELD, "bake", asset.source, *asset.mesh, "-o", baked))
    return float(seconds.read_text())


def has_levels(baked):
    return len(json.loads((baked / "manifest.json").read_text())["levels"]) > 1


def evaluate(asset, baked, views, *options):
    result = baked.with_suffix(".%d.json" % views)
    if not result.exists():
        part = result.with_suffix(".part")
        run(FARFIELD, "evaluate", baked, "--source", asset.source, *asset.mesh, "--views", views, "--json", part, "--sheet",
            baked.with_suffix(".png"), *options)
        part.rename(result)
    return json.loads(result.read_text())["levels"]


def simplify(asset, baked, method, folder):
    """The asset with meshes for levels."""
    meshes = folder / ("%s.%s" % (asset.name, method)) / "meshes.farfield"
    if not (meshes.parent / "done").exists():
        shutil.rmtree(meshes.parent, ignore_errors=True)
        meshes.parent.mkdir(parents=True)
        run(SIMPLIFIED_LEVELS, asset.source, baked, method, meshes, *asset.mesh[1:])
        (meshes.parent / "done").touch()
    return meshes


def measure(asset, folder, options):
    """Folder: of this program."""
    seconds = bake(asset, folder)
    baked = folder / (asset.name + ".farfield")
    if not has_levels(baked):  # no other would be smaller than the source
        return Figures(asset.name, asset.is_tuned, seconds)
    levels = evaluate(asset, baked, options.views)
    simplified = {}
    if SIMPLIFIED_LEVELS.exists():
        meshes_folder = folder / ("meshes_" + program_key(SIMPLIFIED_LEVELS))
        for method in ("simplify", "sloppy"):
            meshes = simplify(asset, baked, method, meshes_folder)
            simplified[method] = (evaluate(asset, meshes, options.views, "--lights", SIMPLIFIED_LIGHT)
                                  if has_levels(meshes) else [])
    return Figures(asset.name, asset.is_tuned, seconds, levels, simplified)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("files", nargs="*")
    parser.add_argument("--views", type=int, default=6)
    parser.add_argument("--only", nargs="*", metavar="NAME")
    parser.add_argument("--list", action="store_true", help="names of all assets")
    parser.add_argument("--page", type=Path, default=ROOT / "docs/results/fidelity.md")
    options = parser.parse_intermixed_args()
    generated = options.folder / "generated"
    known = all_assets(options.files, generated)
    assets = [asset for asset in known if not options.only or asset.name in options.only]
    if options.list:
        return print("\n".join(asset.name for asset in assets))
    wanted = [asset.source.stem for asset in assets if asset.source.parent == generated]
    if wanted:
        run(ROOT / "scripts/make_fidelity_assets.py", generated, *wanted)
    key = program_key(FARFIELD)
    folder = options.folder / key
    folder.mkdir(parents=True, exist_ok=True)
    results = []
    for number, asset in enumerate(assets, 1):
        print("%d of %d: %s" % (number, len(assets), asset.name), flush=True)
        try:
            results.append(measure(asset, folder, options))
        except RuntimeError as error:
            print("  " + str(error), flush=True)
            results.append(Figures(asset.name, asset.is_tuned, failure=str(error)))
    not_asked = [asset.name for asset in known if asset not in assets]
    left_out = [*LEFT_OUT, *([(", ".join(not_asked), "not measured with this program")] if not_asked else [])]
    options.page.write_text(page(results, options.views, left_out, key) + "\n")


if __name__ == "__main__":
    main()
