"""Words for names of the configuration, as figures and the paper's tables show them."""

# Scene -> at most 30 characters; variants marked "short" end before rounding errors dominate.
SCENES = {
    "cloth_all": "upright cloth, three groups", "cloth_all_oop": "hanging cloth, three groups",
    "cloth_all_twin": "horizontal cloth, three groups", "cloth_corner": "wavy cloth on a corner",
    "cloth_side": "upright cloth, fixed at a side", "bend_fall": "falling sheet, bending",
    "bend_poke": "poked sheet, bending", "bend_curved": "curved sheet, bending",
    "bend_roof": "wavy roof, bending", "bend_tumble": "tumbling sheet, bending",
    "spring_stretch": "pulled sheet, springs", "spring_twist": "twisted sheet, springs",
    "spring_oop": "hanging sheet, springs", "strain_stretch": "pulled sheet, strain",
    "strain_twist": "twisted sheet, strain", "strain_poke": "poked sheet, strain",
    "strain_oop": "hanging sheet, strain", "bar_release": "released bar",
    "bar_twist": "twisted bar", "bar80": "long bar", "bar140": "longer bar",
    "taper_twist": "tapered twisted bar", "arch_release": "released arch",
    "torus_release": "released torus", "starfish_twist": "twisted starfish",
    "ball_shell": "hanging ball, springs, bending", "disc_strain": "disc with a hole, strain",
    "dome_strain": "dome, strain", "tube_spring": "tube, springs",
    "sheet100_spring": "hanging sheet, springs", "sheet50_strain": "hanging sheet, strain",
    "sheet100_strain": "hanging sheet, strain", "sheet200_strain": "hanging sheet, strain",
}  # fmt: skip
METHODS = {
    "fom": "full-order model", "published": "preprint's code",
    "deim-joint": "preprint's selection", "deim": "entry-wise DEIM", "qdeim": "entry-wise Q-DEIM",
    "s-opt": "entry-wise S-OPT", "block-deim": "element-wise DEIM",
    "block-qdeim": "element-wise Q-DEIM", "block-s-opt": "element-wise S-OPT",
    "gappy": "three elements per mode", "bounded": "bounded DEIM constant",
    "pod": "orthogonal projection", "hrpd": "fitted projections",
    "ecsw": "reduced positions (ECSW)",
}  # fmt: skip
TRAJECTORIES = {"train": "training", "heldout": "test 1", "kick": "test 2", "stiffness": "test 3"}
_SHORT = "_twin"  # ending of the names of short variants of scenes


def scene(name: str) -> str:
    """Return words for a scene of the study (at most 30 characters), else its name in words."""
    if name not in SCENES and (whole := SCENES.get(name.removesuffix(_SHORT))):
        return f"{whole} (short)"
    return SCENES.get(name) or name.replace("_", " ")


def code(text: str) -> str:
    """Return the name of the scene, method or trajectory with the words ``text``, else ``text``."""
    whole = text.removesuffix(" (short)")
    for known in (SCENES, METHODS, TRAJECTORIES):
        for name, own in known.items():
            if own == whole:
                return name + (_SHORT if whole != text else "")
    return text


def method(name: str, title: str = "") -> str:
    """Return words for a reduction method of the study, else its ``title``, else its name.

    A method ``ecsw-1e-02`` (sampled elements with a tolerance) has the words of ``ecsw``.
    """
    known = METHODS.get("ecsw" if name.startswith("ecsw-") else name)
    return known or title or name.replace("_", " ")
