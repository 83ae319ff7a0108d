/* Where every ball is at any time: between its knots a ball slides in closed form (Eq. 10).
 * A knot is [t, x, y, vx, vy] in s, m and m/s; a ball has one wherever its velocity changes. The
 * operations are those of Run.at, in the same order, so that both give the same bits. */

/** Return the last knot of a ball that is not later than t. */
function lastKnot(knots, t) {
  let low = 0;
  let high = knots.length;
  while (high - low > 1) {
    const middle = (low + high) >> 1;
    if (knots[middle][0] <= t) low = middle;
    else high = middle;
  }
  return knots[low];
}

/** Return position (m) and velocity (m/s) of a ball that slides on from a knot, at the time t. */
function slide([start, x, y, vx, vy], deceleration, t) {
  const elapsed = t - start;
  const speed = Math.sqrt(vx * vx + vy * vy);
  const stop = deceleration > 0 ? (speed > 0 ? speed / deceleration : 0) : Infinity;
  const moving = Math.min(elapsed, stop);
  const lost = speed > 0 ? (deceleration * moving) / speed : 0;
  const reach = moving * (1 - lost / 2);
  const left = elapsed >= stop ? 0 : 1 - lost;
  return { x: x + vx * reach, y: y + vy * reach, vx: vx * left, vy: vy * left };
}

/** Return where ball i of a run is at the time t; after the end, it is where it ended. */
function stateAt(run, i, t) {
  const at = Math.min(Math.max(t, 0), run.duration);
  return slide(lastKnot(run.knots[i], at), run.deceleration, at);
}

/** Return where all balls of a run are at the time t. */
function statesAt(run, t) {
  return run.knots.map((_, i) => stateAt(run, i, t));
}

/** Return how far (m) ball i is from itself in another run, at the time t. */
function gapAt(run, other, i, t) {
  const [here, there] = [stateAt(run, i, t), stateAt(other, i, t)];
  return Math.hypot(here.x - there.x, here.y - there.y);
}

/** Return how far (m) every ball is from itself in another run, at the time t. */
function apart(run, other, t) {
  return run.knots.map((_, i) => gapAt(run, other, i, t));
}

/** Return the time at which each ball left the table: Infinity for one that stays on it. */
function leavingTimes(run) {
  const times = run.knots.map((_, i) => (run.off.includes(i) ? -Infinity : Infinity));
  for (const event of run.events) if (event.kind === "pocket") times[event.balls[0]] = event.t;
  return times;
}

/** Return where a contact happens (m), and the radius of its smaller ball. */
function contactPlace(content, run, event) {
  const [i, j] = event.balls;
  const { x, y } = stateAt(run, i, event.t);
  const { radius } = content.balls[i];
  if (j !== undefined) {
    const share = radius / (radius + content.balls[j].radius);
    const other = stateAt(run, j, event.t);
    return {
      x: x + share * (other.x - x),
      y: y + share * (other.y - y),
      radius: Math.min(radius, content.balls[j].radius),
    };
  }
  const corners = content.table?.outline;
  if (!corners || event.cushion === undefined) return { x, y, radius };
  const [ax, ay] = corners[event.cushion];
  const [bx, by] = corners[(event.cushion + 1) % corners.length];
  const along = ((x - ax) * (bx - ax) + (y - ay) * (by - ay)) / ((bx - ax) ** 2 + (by - ay) ** 2);
  const share = Math.min(Math.max(along, 0), 1);
  return { x: ax + share * (bx - ax), y: ay + share * (by - ay), radius: radius / 2 };
}
