/* Where every ball is at any time: a breakpoint is [t, x, y, vx, vy, ax, ay] in s, m, m/s and m/s^2,
 * and the roll wx, wy (m/s) where balls roll. A ball has one wherever its motion changes; up to the
 * next one its acceleration is constant. Where contacts of a ball persist, a breakpoint also has how
 * its roll changes (m/s^2). The operations are those of Run.at and Run.roll_at, in the same order, so
 * that both give the same bits. */

/** Return the last breakpoint of a ball that is not later than t. */
function lastBreakpoint(breakpoints, t) {
  let low = 0;
  let high = breakpoints.length;
  while (high - low > 1) {
    const middle = (low + high) >> 1;
    if (breakpoints[middle][0] <= t) low = middle;
    else high = middle;
  }
  return breakpoints[low];
}

/** Return position (m), velocity and roll (m/s) of a ball at the time t, from its breakpoints. */
function freeMotion(breakpoints, t) {
  const last = lastBreakpoint(breakpoints, t);
  const [start, x, y, vx, vy, ax, ay, wx = vx, wy = vy] = last;
  const time = t - start;
  const turn = vx === wx && vy === wy ? 1 : -2.5; // While a ball slides, its roll changes by -5/2 a.
  const [turnX = ax * turn, turnY = ay * turn] = last.slice(9);
  return {
    x: x + time * (vx + (time * ax) / 2),
    y: y + time * (vy + (time * ay) / 2),
    vx: vx + time * ax,
    vy: vy + time * ay,
    wx: wx + time * turnX,
    wy: wy + time * turnY,
  };
}

/** Return the times of breakpoints, and more of curves: one for each 0.06 rad of a turn, and as many
 * as keep straight lines between them so near (m) to the curve. */
function bendTimes(breakpoints, end, near) {
  return breakpoints.flatMap(([t, , , vx, vy, ax, ay], k) => {
    const time = (breakpoints[k + 1]?.[0] ?? end) - t;
    const [ux, uy] = [vx + time * ax, vy + time * ay];
    const turn = Math.abs(Math.atan2(vx * uy - vy * ux, vx * ux + vy * uy));
    const [px, py] = [vx + ux, vy + uy];
    const across = Math.abs(ax * py - ay * px) / (Math.hypot(px, py) || 1);
    const off = Math.sqrt((across * time * time) / (8 * near));
    const count = Math.min(Math.max(Math.ceil(turn / 0.06), Math.ceil(off), 1), 250);
    return Array.from({ length: count }, (_, n) => t + (n / count) * time);
  });
}

/** Return where ball i of a run is at the time t; after the run, it is where it ended. */
function stateAt(run, i, t) {
  return freeMotion(run.knots[i], Math.min(Math.max(t, 0), run.duration));
}

/** Return where all balls of a run are at the time t. */
function statesAt(run, t) {
  return run.knots.map((_, i) => stateAt(run, i, t));
}

/** Return how far (m) every ball is from itself in another run, at the time t. */
function apart(run, other, t) {
  const there = statesAt(other, t);
  return statesAt(run, t).map(({ x, y }, i) => Math.hypot(x - there[i].x, y - there[i].y));
}

/** Return the kinetic energy (J) of all balls at the time t, with that of the roll where they roll. */
function energyAt(run, t) {
  return statesAt(run, t).reduce((sum, { vx, vy, wx, wy }, i) => {
    return sum + (run.masses[i] / 2) * (vx * vx + vy * vy + run.gyration * (wx * wx + wy * wy));
  }, 0);
}

/** Return the momentum of all balls [x, y] (N s) at the time t. */
function momentumAt(run, t) {
  return statesAt(run, t).reduce(
    ([x, y], { vx, vy }, i) => [x + run.masses[i] * vx, y + run.masses[i] * vy],
    [0, 0],
  );
}

/** Return the time at which each ball left the table; it is Infinity for one that stays on it. */
function leavingTimes(run) {
  const times = run.knots.map((_, i) => (run.off.includes(i) ? -Infinity : Infinity));
  for (const event of run.events) if (event.kind === "pocket") times[event.balls[0]] = event.t;
  return times;
}
