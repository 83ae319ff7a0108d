"""Here are the records of the solvers, by name, in the order that users see.

A solver's file is imported before its first run, so that nobody waits for the others.
"""

from __future__ import annotations

from pool_pymunk.solvers.record import InFile, Solver

PUBLISHED_STEP = 1e-6  # s; the report uses this slice

PYMUNK = Solver(
    name="pymunk", solve=InFile("pymunk_space"),
    about="in a pymunk space, contacts inside the step", dt=1 / 240,
    options={"friction": ("joint", "callback")}, exact=True, engine=True, rolls=True, patches=True,
    tilts=True, to_tolerance=True, finest=1e-4, ladder=(1 / 30, 1 / 60, 1 / 120, 1 / 240, 1e-3),
    stability_steps=(1 / 60, 1 / 240, 1 / 1000), quick_stability_steps=(1 / 60,),
    color="#009e73", marker="o",
)  # fmt: skip

DISCRETE = Solver(
    name="pymunk-discrete", solve=InFile("pymunk_discrete"), about="the method in one file",
    dt=1e-4, options={"friction": ("callback",)}, late=True, finest=5e-6,
    limits="answers overlaps at the end of a step, one after the other: it misses grazes and what "
    "tunnels, and every contact comes up to a step late",
    ladder=(1 / 60, 1 / 120, 1 / 240, 2e-3, 1e-3, 5e-4, 2e-4, 1e-4, 5e-5),
    quick_stability_steps=(1e-3,), color="#56b4e9", marker="s",
)  # fmt: skip

BUILTIN = Solver(
    name="pymunk-builtin", solve=InFile("pymunk_builtin"),
    about="a baseline: stock pymunk", dt=1 / 240, late=True, own_law=True,
    limits="another contact law, with spin and its own rules for touching balls; contacts come up "
    "to a step late",
    ladder=(1 / 60, 1 / 120, 1 / 240, 2e-3, 1e-3, 5e-4, 2e-4, 1e-4),
    no_tolerance="its physics is not the scene's, so no step brings it within a tolerance",
    color="#999999", marker="X",
)  # fmt: skip

EVENT_DRIVEN = Solver(
    name="event-driven", solve=InFile("event_driven"),
    about="exact: from contact to contact", dt=None, exact=True, engine=True, rolls=True,
    patches=True, tilts=True, to_tolerance=True,
    no_tolerance="it is exact and has no step: no tolerance is needed",
    color="#000000", marker="*",
)  # fmt: skip

TIME_SLICE = Solver(
    name="time-slice", solve=InFile("time_slice"), about="the report's own algorithm",
    dt=PUBLISHED_STEP, late=True, rolls=True,
    limits="the report's method: contacts come up to a slice late, a pair answers only once "
    "until it has parted (unless its balls roll), contacts of one instant are answered one after "
    "the other, and rounding decides the sign of a slip of zero",
    ladder=(1e-2, 3e-3, 1e-3, 3e-4, 1e-4, 3e-5, 1e-5, 3e-6, PUBLISHED_STEP),
    stability_steps=(1e-5,), quick_stability_steps=(1e-4,), all_pairs=True,
    published_step=PUBLISHED_STEP, finest=1e-6, color="#d55e00", marker="D",
)  # fmt: skip

SOLVERS: dict[str, Solver] = {
    solver.name: solver for solver in (PYMUNK, DISCRETE, BUILTIN, EVENT_DRIVEN, TIME_SLICE)
}
