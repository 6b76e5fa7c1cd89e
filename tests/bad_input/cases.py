"""The corpus of broken inputs and the parts that each error message must contain."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from bad_input import project
from bad_input.project import MESH, SCENE, SMALL_SCENE, SMALL_STUDY, STUDY, Content, LinkTo, Replace

METHODS, CLAIMS = (f"config/{name}.yaml" for name in ("methods", "claims"))


@dataclass(frozen=True)
class Case:
    """Describe one fault.

    changes : files of the small project and their broken content
    parts : texts that the message must contain: file, key, value, allowed values
    overrides : settings that ``--config`` adds
    """

    name: str
    changes: Mapping[str, Content]
    parts: tuple[str, ...]
    overrides: Mapping[str, Any] = field(default_factory=dict)


def study(name: str, text: str | bytes, *parts: str) -> Case:
    """The study's file with other content."""
    return Case(name, {STUDY: text}, parts)


def more(name: str, lines: str, *parts: str) -> Case:
    """The study's file with further lines."""
    return Case(name, {STUDY: SMALL_STUDY + lines}, parts)


def override(name: str, key: str, value: Any, *parts: str) -> Case:
    """A value that ``--config`` gives."""
    return Case(name, {}, ("configuration", *parts), {key: value})


def scene(name: str, old: str, new: str, *parts: str) -> Case:
    """The scene's file with one text replaced."""
    return Case(name, {SCENE: Replace(old, new)}, (SCENE, *parts))


def effect(name: str, entry: str, *parts: str) -> Case:
    """The scene's file with another effect in place of its gravity."""
    return scene(name, "- {effect: gravity}", f"- {{{entry}}}", *parts)


def select(name: str, selection: str, *parts: str) -> Case:
    """The scene's file with another selection of its pins."""
    return scene(name, "select: left", f"select: {selection}", *parts)


def mesh(name: str, content: Content, *parts: str, path: str = MESH) -> Case:
    """A mesh file with broken content."""
    use = project.with_mesh(f"{{kind: file, path: {path}}}")
    return Case(name, {SCENE: use, f"config/scenes/{path}": content}, (SCENE, path, *parts))


def mesh_path(name: str, path: str, *parts: str, **changes: Content) -> Case:
    """A mesh path that the project must refuse."""
    use = project.with_mesh(f'{{kind: file, path: "{path}"}}')
    return Case(name, {SCENE: use, **changes}, (SCENE, *parts))


def other(name: str, path: str, old: str, new: str, *parts: str) -> Case:
    """Another configuration file with one text replaced."""
    return Case(name, {path: Replace(old, new)}, (path, *parts))


BIG = 99999999999999999999
LONG_SCENE = SMALL_SCENE.replace("rows: 5", "rows: 500").replace("frames: 8", "frames: 100000")
GROUND = "v 0 0 0\nv 1 0 0\nv 1 0 1\nv 0 0 1\n"
PLY = "ply\nformat ascii 1.0\nelement vertex {n}\nproperty float x\nproperty float y\n"
PLY += "property float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n"
TETRAHEDRA = """\
$MeshFormat
2.2 0 8
$EndMeshFormat
$Nodes
{n}
{nodes}
$EndNodes
$Elements
{m}
{elements}
$EndElements
"""
CORNERS = "1 0 0 0\n2 1 0 0\n3 0 1 0\n4 0 0 1"

STUDY_CASES = [
    study("empty study", "", STUDY, "a mapping of keys is required", "nothing"),
    study("template that runs code", SMALL_STUDY + "__use_yte__: true\n?ranks: 1\n",
          STUDY, "__use_yte__", "not allowed"),
    study("scenes missing", "methods: [pod]\n", STUDY, "'scenes' is missing"),
    study("no scene at all", "scenes: []\nmethods: [pod]\n", STUDY, "scenes = []", "at least 1"),
    more("misspelt key", "rank: [6]\n", "unknown key 'rank'", "did you mean 'ranks'?"),
    more("set without name", "claim_sets: {owns: [spring_oop]}\n", "claim_sets", "'owns'", "own"),
    more("number of base 60", "timing: {repeats: 2:0}\n", STUDY, "timing.repeats = 2:0", "120"),
    more("reference that is not run", "sensitivity: {reference: 1.0e-5}\n",
         "reference = 1e-05", "one of the perturbations"),
    more("position basis of unknown kind", "subspace: {bases: [svd]}\n",
         "subspace.bases.0 = 'svd'", "'pod' or 'skinning'"),
    more("position subspace of no scene", "subspace: {scenes: [smal]}\n",
         "subspace.scenes", "'smal'", "did you mean 'small'?"),
    override("ranks as a word", "ranks", "six", "ranks = 'six'", "valid list"),
    Case("unknown scene", {}, ("scenes: unknown scene 'smal'", "did you mean 'small'?"),
         {"scenes": ["smal"]}),
    override("scene that leaves the folder", "scenes", ["../scenes/small"],
             "scenes.0 = '../scenes/small'", "begins with a small letter"),
    Case("unknown method", {}, ("methods: unknown method 'pood'", "did you mean 'pod'?"),
         {"methods": ["pood"]}),
]  # fmt: skip
SCENE_CASES = [
    Case("scene without a file", {SCENE: None}, ("scenes", "unknown scene 'small'", "allowed: ")),
    scene("name of another scene", "name: small", "name: large", "name = 'large'", "'small'"),
    scene("too many frames", "frames: 8", "frames: 1000001", "frames = 1000001", "1000000"),
    Case("run that no disk holds", {SCENE: LONG_SCENE},
         (SCENE, "frames = 100000 on 2000 vertices", "at most 80000 frames")),
    scene("time step NaN", "time_step: 0.016", "time_step: .nan", "time_step = nan"),
    scene("no effects", SMALL_SCENE[SMALL_SCENE.index("effects:"):SMALL_SCENE.index("reduce:")],
          "effects: []\n", "no constraint group"),
    scene("no constraint", "  - {effect: spring, weight: 1.0e+5}\n", "", "no constraint group"),
    scene("effect as a word", "- {effect: gravity}", "- gravity", "effects[0] = 'gravity'",
          "no mapping with a key 'effect'"),
    scene("unknown effect", "effect: spring", "effect: sprnig", "effects[2]", "unknown effect",
          "allowed: area, bending", "did you mean 'spring'?"),
    scene("unknown key of an effect", "select: left", "selct: left", "effects[1] (pins)", "selct"),
    scene("negative weight", "weight: 1.0e+5", "weight: -1.0", "(spring)", "weight = -1.0"),
    scene("no weight", ", weight: 1.0e+5", "", "(spring)", "'weight' is missing"),
    scene("huge gravity", "effect: gravity", "effect: gravity, acceleration: [0, -1.0e+300, 0]",
          "(gravity)", "acceleration.1 = -1e+300"),
    select("pin of no side", "middle", "pins", "'middle'", "left, right"),
    select("pin that selects nothing", "[]", "pins", "selects no vertex"),
    *(select(f"pin of vertex {index}", f"[{index}]", "pins", "0 to 19") for index in (20, -1, BIG)),
    effect("handle against pin", "effect: translate, select: left, offset: [1, 0, 0], over: 3",
           "held by 'translate' and by 'pins' in frame 0"),
    effect("more pokes than vertices", "effect: poke, count: 500", "count = 500", "20 vertices"),
    scene("group that is not there", "spring: {train: 4}", "strain: {train: 4}", "reduce.strain",
          "allowed: spring"),
    scene("more training than frames", "train: 4", "train: 5", "reduce.spring.train = 5", "4 even"),
    scene("mesh of unknown kind", "kind: cloth", "kind: sphere", "mesh", "'cloth', 'bar', 'file'"),
    scene("sheet of too many vertices", "rows: 5, columns: 4", "rows: 2000, columns: 2000",
          "mesh.cloth", "rows = 2000 x columns = 2000", "4000000 vertices", "1000000"),
    *(scene(f"masses {entry}", "frames: 8", f"frames: 8\nmasses: [{entry}]", part)
      for entry, part in (
        ("{select: top}", "either vertex_mass or density"),
        ("{vertex_mass: 1, density: 1}", "either vertex_mass or density"),
        ("{density: 0}", "density"),
        ("{select: 1, density: 1}", "select"),
        ("{density: 1}, {select: top, vertex_mass: 1}", "masses[1]: "),
        ("{density: 2}, {select: top, vertex_mass: 1}", "flat along this axis"),
      )),
    *(effect(f"keys {keys}", f"effect: keyframes, select: right, keys: [{keys}]", part)
      for keys, part in (
        ("", "keys"),
        ("{at: 0}", "keys.0.at = 0"),
        ("{at: 5}, {at: 5}", "at = 5 must be greater than 5"),
        ("{at: 5, ofset: [0, 0, 0]}", "unknown key 'keys.0.ofset'"),
        ("{at: 6, ofset: [0, 0, 0]}", "did you mean 'offset'"),
        ("{at: 5, offset: [0, 0, .inf]}", "offset"),
      )),
    effect("box turned inside out", "effect: box, lower: [0, 1, 0], upper: [1, 0, 1]",
           "lower = 1 exceeds upper = 0"),
    scene("factor of no element", "weight: 1.0e+5",
          "weight: 1.0, factors: [{select: [0], factor: 2}]", "effect 'spring': factors[0]",
          "has all vertices in select", "edge"),
    select("empty box", "{kind: box, lower: [0, 0, 1], upper: [1, 1, 0]}", "lower = 1 exceeds"),
    select("all but all", f"{{kind: complement, of: {[*range(20)]}}}", "selects no vertex"),
    scene("tetrahedra on a sheet", "effects:\n",
          "effects:\n  - {effect: tetrahedron_strain, weight: 1.0}\n",
          "tetrahedron_strain", "needs tetrahedra", "fTetWild or gmsh"),
]  # fmt: skip

MESH_CASES = [
    mesh("missing mesh", None, "no such mesh file (looked in /", path="meshes/none.obj"),
    mesh("mesh without cells", GROUND, "no cells"),
    mesh("mesh of a folded quadrilateral", GROUND + "f 1 2 4 3\n", "[0, 1, 3, 2]", "triangulate"),
    mesh("mesh with a wrong extension", "v 0 0 0\n", ".obj, .stl", "meshio convert a.xyzzy a.vtu",
         path="meshes/a.xyzzy"),
    *(mesh(f"mesh that may refer to other files, {suffix}", GROUND, "meshio convert",
           path=f"meshes/a{suffix}")
      for suffix in (".xdmf", ".xmf", ".pvd", ".vtm", ".inp", ".geo", ".ele", ".node", ".xml",
                     ".med", ".h5m", ".hmf", ".cgns", ".e", ".exo", ".vol.gz")),
    mesh("edge of five triangles",
         "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nv 0 -1 0\nv 0 0 -1\nv 0 1 1\n"
         + "".join(f"f 1 2 {k}\n" for k in range(3, 8)),
         "edge [0, 1] belongs to 5 triangles", "at most 2"),
    mesh("triangle given twice", GROUND + "f 1 2 3\nf 1 3 4\nf 3 1 2\n",
         "triangle 2 [2, 0, 1] repeats triangle 0 [0, 1, 2]"),
    mesh("tetrahedron given twice",
         TETRAHEDRA.format(n=4, nodes=CORNERS, m=2,
                           elements="1 4 2 0 1 1 2 3 4\n2 4 2 0 1 2 1 3 4"),
         "tetrahedron 1", "repeats tetrahedron 0", path="meshes/a.msh"),
    mesh("face of three tetrahedra",
         TETRAHEDRA.format(n=6, nodes=CORNERS + "\n5 0 0 -1\n6 1 1 1", m=3,
                           elements="1 4 2 0 1 1 2 3 4\n2 4 2 0 1 1 2 3 5\n3 4 2 0 1 1 2 3 6"),
         "face [0, 1, 2] belongs to 3 tetrahedra", path="meshes/a.msh"),
    mesh("vertex at 1e300", GROUND.replace("v 1 0 1", "v 1e300 0 1") + "f 1 2 3\nf 1 3 4\n",
         "vertex 2 lies at [1e+300, 0.0, 1.0]", "from -1e+06 to 1e+06"),
    mesh("mesh smaller than a micrometre",
         GROUND.replace("1", "1e-9") + "f 1 2 3\nf 1 3 4\n", "extent 1e-09", "at least 1e-06"),
    mesh("mesh that ends early", PLY.format(n=9) + "0 0 0\n",
         "truncated", path="meshes/a.ply"),
    mesh("index out of range", GROUND + "f 1 2 3\nf 1 3 9\n", "corners [0, 2, 8]", "0 to 3"),
    mesh("index zero", GROUND + "f 0 1 2\nf 1 2 3\nf 1 3 4\n", "corners [-1, 0, 1]", "0 to 3"),
    mesh("NaN among the points", GROUND.replace("v 1 0 0", "v nan 0 0") + "f 1 2 3\nf 1 3 4\n",
         "nan"),
    mesh("vertex in no element", GROUND + "f 1 2 3\n", "in no element", "the first is 3"),
    mesh("vertex given twice", GROUND + "v 1 0 1\nf 1 2 3\nf 1 5 4\n", "vertex 4", "vertex 2",
         "`merge"),
    mesh("flat tetrahedron",
         TETRAHEDRA.format(n=4, nodes="1 0 0 0\n2 1 0 0\n3 0 1 0\n4 1 1 0", m=1,
                           elements="1 4 2 0 1 1 2 3 4"), "zero volume", path="meshes/a.msh"),
    mesh("tetrahedra beside triangles",
         TETRAHEDRA.format(n=5, nodes=CORNERS + "\n5 0 0 -1", m=2,
                           elements="1 4 2 0 1 1 2 3 4\n2 2 2 0 1 1 2 5"),
         "tetra", "triangle", "only one of", path="meshes/a.msh"),
    mesh_path("absolute mesh path", "/etc/passwd", "/etc/passwd", "below the folder"),
    mesh_path("mesh path that leaves the project", "../../square.obj", "../../square.obj",
              "without '..'"),
    mesh_path("link out of the project", "meshes/out.obj", "meshes/out.obj", "leads out",
              **{"config/scenes/meshes/out.obj": LinkTo("/etc/passwd")}),
]  # fmt: skip

OTHER_CASES = [
    Case("empty methods", {METHODS: ""}, (METHODS, "a mapping of method names is required")),
    other("method without a title", METHODS, "title: POD projection, ", "", "'pod'", "title"),
    other("method that contradicts itself", METHODS, "rows: joint, selection: greedy",
          "rows: joint, selection: pivoted-qr", "only 'greedy'"),
    other("method with an unknown ingredient", METHODS, "rows: all", "rows: every",
          "'pod'", "rows = 'every'", "'all', 'scalar', 'joint' or 'element'"),
    other("unknown selection", METHODS, "selection: pivoted-qr", "selection: pivoted-rq", "'qdeim'",
          "allowed: greedy, pivoted-qr, s-opt", "did you mean 'pivoted-qr'"),
    other("interpolation of whole elements", METHODS, "selection: greedy, solve: qr}",
          "selection: greedy, solve: square}", "'block-deim'", "allowed are qr, tikhonov"),
    other("method with a title in another script", METHODS, "title: POD projection",
          "title: \u6295\u5f71", "pod.title", "U+6295", "cannot be typeset"),
    other("claim by an unknown metric", CLAIMS, "metric: local_share", "metric: local_shar",
          "C1", "'local_shar'"),
    other("claim about an unknown column", CLAIMS, "where: {implementation:",
          "where: {implementaton:", "C1", "'implementaton'", "did you mean 'implementation'?"),
]  # fmt: skip

CASES = STUDY_CASES + SCENE_CASES + MESH_CASES + OTHER_CASES
