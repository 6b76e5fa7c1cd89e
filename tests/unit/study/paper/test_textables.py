"""TeX tables from the tables of the study, cell by cell."""

import pytest

from builders import frame
from pdrom.core.store import write_table
from study.artifact.paths import File
from study.paper.build import shown_tables
from study.paper.tex import build_pdfs
from study.paper.textables import TEX_TABLES, tabular, tex_table
from study.tables import declared

EITHER = ("both", "position")
ERROR = "relative_error_within_horizon"

TABLES = {
    "methods": frame(
        "method title centring rows selection solve oversampling gain_bound",
        ("pod", "A & B", "none", "all", "greedy", "square", 1, None),
        ("deim_x", "50 %", "affine", "scalar", "greedy", "qr", 3, None),
        ("y", "c", "affine", "scalar", "greedy", "qr", 1, None),
        ("z", "d", "affine", "scalar", "greedy", "qr", 3, 2.5),
    ),
    "scenes": frame(
        "scene groups vertices elements frames",
        ("bar_a", "triangle_strain (1e+07)", 400, 722, 10),
        ("b", "spring (1)", 9, 12, 20),
        ("not_run", "spring (1)", 9, 12, 20),
    ),
    "reduced_reruns": frame(
        "scene group method position_basis r frames blowup_frame horizon_frame "
        f"{ERROR} k speedup",
        ("bar_a", "edge_spring", "pod", "full", 6, 10, None, 10, 0.5, None, None),
        ("bar_a", "edge_spring", "pod", "full", 20, 10, None, 10, 0.25, None, None),
        ("bar_a", "edge_spring", "pod", "full", 30, 0, None, 10, None, None, None),
        ("bar_a", "edge_spring", "deim_x", "full", 6, 10, None, 10, 0.75, None, None),
        ("bar_a", "edge_spring", "deim_x", "full", 20, 5, 4, 10, None, None, None),
        ("b", "bending", "pod", "full", 6, 0, None, 7, None, None, None),
        ("b", "all", "full", "pod", 6, 10, None, 7, 0.125, 6, 2.5),
        ("b", "all", "ecsw-1e-02", "pod", 90, 10, None, 7, 0.375, 6, 4.0),
        *(("b", "all", "full", "pod", 7, 9, None, 9, e, 6, None) for e in (0.25, 0.5, 9.0)),
    ).assign(
        motion=["train"] * 8 + ["heldout", "kick", "stiffness"],
        playback_error=0.75,
        deformation_error=0.5,
    ),
    "test_trajectories": frame(
        "scene motion deformation affine replay_error replay_deformation_error full_order_error "
        "full_order_deformation_error reference_error reference_deformation_error",
        ("bar_a", "heldout", 0.25, 0.125, 0.75, 1.0, 0.5, 2.0, 0.0, 0.0625),
        ("bar_a", "kick", 0.5, 0.25, 0.5, 0.75, 0.25, None, 0.0, 1e-9),
    ),
    "error_budget": frame(
        "motion part error deformation_error largest",
        ("heldout", "span", 0.25, 0.125, False), ("heldout", "closure", 0.5, 0.5, True),
        ("kick", "span", 0.75, None, True), ("kick", "closure", 0.75, 0.75, False),
    ).assign(scene="bar_a", k=40, skinning=[0, 0, 40, 40]),
    "accuracy_cost": frame(
        f"scene method iterations {ERROR} ms_per_frame",
        ("bar_a", "fom", 1, 0.5, 0.25),
        ("bar_a", "fom", 10, 0.125, 2.0),
        ("bar_a", "fom-anderson", 10, 0.0625, 3.0),
        ("bar_a", "pod", None, 0.03, 1.0),
    ),
    "stability": frame(
        "method position_basis experiment outcome energy_ratio",
        ("full", "full", "rerun", "accurate", 1.0),
        ("pod", "full", "rerun", "accurate", 1.0),
        ("pod", "full", "rerun", "blow-up", float("inf")),
        ("pod", "full", "rerun", "not run", None),
        ("pod", "full", "rerun", "wrong", 3.0),
        ("pod", "full", "sweep", "wrong", 2.0),
        ("ecsw", "pod", "rerun", "accurate", 0.5),
    ),
    "claims": frame(
        "claim paper verdict figure_or_table verdict_beyond verdict_both verdict_beyond_both",
        ("C1", "70 % or more", "holds", "local_share", "depends", "holds", "holds"),
        ("C2", "x", "cannot be decided", "a", "holds", "cannot be decided", "holds"),
        ("C3", "y", "does not hold", "b", "does not hold", "depends", "does not hold"),
    ),
    "claims_tests": frame(
        "claim part what decides compare threshold satisfied of least median most",
        ("C1", "published", "some_one", True, ">=", 0.1, 1, 2, 0.05, 0.1, float("inf")),
        ("C1", "published", "others", True, ">=", 0.1, 3, 4, 0.0, 0.5, 1.0),
        ("C1", "published", "aside", False, "<=", 0.1, 5, 6, 0.0, 0.5, 1.0),
        ("C1", "beyond", "all", True, "<=", 0.05, 0, 0, None, None, None),
    ).assign(margin=1.5),
    "replication": frame(
        "replication claim part verdict verdict_replication",
        ("first", "C1", "published", "holds", "depends"),
        ("first", "C1", "beyond", "not tested", "holds"),
        ("second", "C1", "published", "holds", "holds"),
        ("second", "C1", "beyond", "not tested", "cannot be decided"),
    ),
    "speedups": frame(
        "scene method position_basis k r full_ms shown loses error_train "
        "error_heldout playback_error training_s reduction_s frames_to_break_even",
        ("bar_a", "deim_x", "full", None, 6, 1.2, "0.50", True, 0.1, None, None, 2.0, 0.5, None),
        ("b", "ecsw", "pod", 20, 97, 8.0, "66 to 73", False, 0.01, 0.02, 0.5, 1.0, 3.0, 1234.5),
    ).assign(deformation_train=0.25, deformation_heldout=None),
    "frontier": frame(
        "part method simulated iterations k skinning tolerance training_motions validation_error "
        "position_error deformation_error time_ratio offline_ratio ahead "
        "ahead_test ahead_deformation",
        ("reduced", "ecsw", 9, 5, 40, 10, 0.01, 2, 0.05, 0.0625, 0.125, 0.5, 1234.5,
         2.0, 1.5, None),
        ("reduced", "ecsw-newton", 9, None, 20, 0, 0.1, 1, 0.02, 0.0625, None, 0.75, 90.0,
         *3 * [None]),
        *(
            (part, method, *sizes, *4 * [None], error, 0.125, 0.25, 1.0, *4 * [None])
            for part, method, sizes, error in (
                ("coarser mesh", "coarser-mesh-anderson", (4, 3), 0.1),
                ("coarser mesh", "coarser-mesh", (4, 1), 0.11), ("same mesh", "fom", (9, 3), 0.1),
                ("coarser mesh", "coarser-mesh", (4, 9), 0.07),
            )
        ),
    ).assign(scene="bar_a", factor=1.0, vertices=9),
    "payoff": frame(
        "measure position_basis method scenes accurate pays loses least_speedup best_speedup "
        "most_speedup error_train error_heldout heldout playback_error accurate_heldout "
        "pays_heldout",
        ("position", "full", "coarser-mesh", 3, 2, 1, 0, None, float("inf"), *3 * [None], 0, None,
         0, 0),
        ("position", "pod", "ecsw-1e-02", 3, 2, 1, 1, *5 * [0.5], 2, 0.9, 2, 1),
        ("both", "pod", "ecsw-1e-02", 2, 1, 1, 0, *5 * [0.5], 2, 0.9, 2, 0),
    ),
    "gain_interventions": frame(
        "step mesh pairs failing rescued failing_after error_before error_after gain_ratio "
        "error_ratio error_ratio_low error_ratio_high families families_fallen",
        ("three elements a mode for one", "sheets", 8, 5, 2, 3, 0.5, 0.25, 0.5, 0.25, 0.125, 0.5,
         4, 3),
        ("three elements a mode for one", "all", *12 * [1]),
        ("three elements, separate coefficients", "bars", 8, 2, 1, 1, 0.75, 0.5, 0.5, 0.625,
         *4 * [1]),
    ),
}  # fmt: skip


# Expected rows of each table, with their subject above them.
MADE = r"""
% verdicts with their colour, and the tests that decide; a place without a figure is a table
% claims
C1 & 70 \% or more & \textcolor{okgreen}{holds} (1/2, 3/4) & \textcolor{okgrey}{mixed} (0/0); both
  errors: holds & figure~\ref{fig:local_share} \\
C2 & x & \textcolor{okgrey}{--} & \textcolor{okgreen}{holds} & \texttt{a} \\
C3 & y & \textcolor{okred}{does not hold}; both errors: mixed
  & \textcolor{okred}{does not hold} & \texttt{b} \\
% claims_in_full
C1 published & some\_one & $\ge$ 0.10 & 1 of 2 & 0.050 & 0.10 & \ensuremath{\infty} \\
 & others & $\ge$ 0.10 & 3 of 4 & 0 & 0.50 & 1 \\
C1 improved & all & $\le$ 0.050 & 0 of 0 & -- & -- & -- \\
% only the changes of the paper's table
% interventions
three elements per mode instead of one, sheets & 0.50 & 0.25 & 0.12 to 0.50 & 3 of 4 & 2 of 5 \\
% square
bars, separate systems & 2 of 8 & 0.75 & 1 of 8 & 0.50 & 0.62 \\
% what is not decided
% replications
C1 & holds & mixed & holds & -- & holds & -- \\
% the horizon of a calm scene is its run
% scenes
bar a & \texttt{bar\_a} & triangle strain ($10^{7}$) & 400 & 722 & 10 & run \\
b & \texttt{b} & spring (1) & 9 & 12 & 20 & 7 \\
not run & \texttt{not\_run} & spring (1) & 9 & 12 & 20 & -- \\
% trajectories
bar a & test 1 & 0.25 & 0.12 & 0.75 & 1 & 0.50 & 2 & 0.062 \\
bar a & test 2 & 0.50 & 0.25 & 0.50 & 0.75 & 0.25 & -- & $<10^{-6}$ \\
% where there is no deformation, the position error counts
% error_budget
bar a & 40 & 0.12 & 0.50 & -- & -- & -- & closure 1 \\
bar a & 40 + 40 & 0.75 & 0.75 & -- & -- & -- & span 1 \\
% methods
orthogonal projection & \texttt{pod} & none & all & -- & -- & square \\
50 \% & \texttt{deim\_x} & affine & scalar & greedy & 3 per mode & qr \\
c & \texttt{y} & affine & scalar & greedy & one per mode & qr \\
d & \texttt{z} & affine & scalar & greedy & $\gamma \le 2.5$ & qr \\
% the largest size that ran: without ranks beyond the data, and subspaces
% reruns
bar a & edge spring & 0.25 & \textcolor{okred}{blow-up, 4} & -- & -- \\
% what ran
% stability
orthogonal projection & 1 & 1 & 0 & 1 & 3 & \ensuremath{\infty} & 0 of 1 & 2 \\
reduced positions (ECSW), POD columns & 1 & 0 & 0 & 0 & 0.50 & 0.50 & 0 of 0 & n/a \\
% error and time
% iterations
bar a & 0.50 (0.25) & -- & 0.12 (2) & -- & 0.062 (3) \\
% positions
b & 0.12 & 0.50 & 0.38 & -- & 90 & 4 & -- & -- \\
% two digits of a count
% speedups
bar a & deim x, $r = 6$ & 0.50 & 1.2 & 0.10 & -- & never \\
b & reduced positions (ECSW), $k = 20$ & 66 to 73 & 8 & 0.010 & 0.020 & 1200 \\
% position errors only; full-order settings have no test trajectories
% payoff
full-order model, coarser mesh & 3 & 2 & -- & 1 & \ensuremath{\infty} \\
reduced positions (ECSW) & 3 & 2 & 2 & 1 & 0.50 \\
% settings accurate to a tenth and not too close, without those on the same mesh
% frontier
bar a, 9 & 30 + 10, $\tau = 0.01$, $K = 5$, $n = 2$ & 0.050 & 0.062 & 0.50 & 1200 & 2 / 1.5 \\
 & 20, $\tau = 0.1$, converged, $n = 1$ & 0.020 & 0.062 & 0.75 & 90 & -- / -- \\
bar a, 9 & 4 vertices, $K = 3$, accelerated & 0.10 & 0.12 & 1 & -- & -- \\
"""


@pytest.mark.parametrize("name", TEX_TABLES)
def test_a_table_of_the_manuscript_has_the_expected_rows(name):
    """The rows of its body, each with as many cells as its head."""
    lines = tex_table(name, TABLES).splitlines()
    head, *lines = [line for line in lines if line.endswith(r" \\")]
    _, after = MADE.replace("\n  ", " ").split(f"\n% {name.removeprefix('tab_')}\n")
    assert [x for x in lines if x != head] == after.partition("\n%")[0].splitlines()
    assert len({line.replace(r"\&", "").count("&") for line in (head, *lines)}) == 1


def test_unreliable_times_leave_no_speed_up_in_any_table(tmp_path):
    times = frame("control_low control_high processor_share", (1.0, 1.0, 0.5))
    files = []
    for name in TABLES.keys() & declared().keys() | {"frame_times"}:
        files.append(File(f"{tmp_path}/{name}.csv", {"name": name}))
        write_table(TABLES.get(name, times), files[-1].path)
    tables, said = shown_tables(files)
    assert "unreliable" in said
    text = "".join(tex_table(name, TABLES | tables) for name in TEX_TABLES)
    before = "".join(tex_table(name, TABLES) for name in TEX_TABLES)
    assert "66 to 73" in before
    assert "66 to 73" not in text


PAGE = r"""\documentclass{article}\usepackage[T1]{fontenc}\usepackage{lmodern}\usepackage{longtable}
\newcommand{\captionrow}{\caption{Table}\\}\begin{document}%s\end{document}"""


@pytest.mark.parametrize("long", [False, True])
@pytest.mark.parametrize("rows", [[], [["a", "1"]], [["a", "1"], ["b", "2"]]])
def test_a_table_of_the_manuscript_is_typeset(long, rows, tmp_path):
    """A table without rows belongs to a configuration without the results that the table shows."""
    text = tabular(["name", "number"], rows, "lr", long)
    assert text.count(r"name & number \\") == (2 if long else 1)
    assert [line for line in text.splitlines() if line.startswith(("a &", "b &"))] == [
        rf"{name} & {number} \\" for name, number in rows
    ]
    (tmp_path / "main.tex").write_text(PAGE % text)
    build_pdfs({tmp_path / "main.tex": tmp_path / "main.pdf"}, [])
    assert (tmp_path / "main.pdf").read_bytes().startswith(b"%PDF")
