/* The table, the balls and their tracks on a canvas. They look as in the pictures and films: this
 * look comes with the content, as `look`, `table` and `plane`. */

const LONGEST = 0.25; // of what is seen; no arrow of a shot is longer
const STROKES = 640; // The tracks of a run take about this number of strokes,
const FEWEST = 3; // but each track at least this number.
const CROWD = 30; // More balls than these have tracks without halos, and no names beside them.
const LETTERS = 40; // A name beside a ball has no more letters than this.
const GHOST = 0.45; // the opacity of the balls of a run to compare with
const FONT = '"DejaVu Sans", system-ui, sans-serif';

class TableView {
  constructor(canvas) {
    this.canvas = canvas;
    this.pen = canvas.getContext("2d");
    this.sprites = new Map();
    this.under = this.over = null; // These draw what a live table adds, below and above the balls.
  }

  /** Show another content, or the same in other colours; what looks the same is not drawn again. */
  show(content, style) {
    const looks = JSON.stringify({ ...content, shots: null, live: null, style });
    Object.assign(this, { content, style });
    if (looks !== this.looks) this.forget();
    this.looks = looks;
  }

  /** Draw the ground and the balls again when they are next shown. */
  forget() {
    this.ground = null;
    this.sprites.clear();
  }

  /** Make the canvas as large as a width and a height (CSS pixels) allow. */
  fit(width, height) {
    const [x0, y0, x1, y1] = this.content.seen;
    const scale = Math.min(width / (x1 - x0), height / (y1 - y0));
    this.ratio = setSize(this.canvas, scale * (x1 - x0), scale * (y1 - y0));
    if (this.scale !== this.ratio * scale) this.forget();
    this.scale = this.ratio * scale; // canvas pixels a metre
    this.left = -this.scale * x0;
    this.bottom = this.scale * y1;
  }

  place(x, y) {
    return [this.left + this.scale * x, this.bottom - this.scale * y];
  }

  /** Return the point of the plane (m) under the pointer. */
  point({ clientX, clientY }) {
    const { left, top } = this.canvas.getBoundingClientRect();
    const [x, y] = [clientX - left, clientY - top].map((pixels) => pixels * this.ratio);
    return [(x - this.left) / this.scale, (this.bottom - y) / this.scale];
  }

  /** Return the ball of a run that is under the pointer at the time t, or the nearest one within
   * this distance (pixels); null for none. */
  nearest(event, run, t, within) {
    const [x, y] = this.point(event);
    const { balls } = this.content;
    const gap = (at, i) => Math.hypot(at.x - x, at.y - y) - balls[i].radius;
    const gaps = statesAt(run, t).map((at, i) => (t < run.leaves[i] ? gap(at, i) : Infinity));
    const least = Math.min(...gaps);
    return (least * this.scale) / this.ratio <= within ? gaps.indexOf(least) : null;
  }

  /** Put a box with words below a point (m), to the right of it, within the frame. */
  putBeside(box, x, y) {
    const [px, py] = this.place(x, y).map((pixel) => pixel / this.ratio);
    const { clientWidth, clientHeight } = box.parentElement;
    const at = this.canvas.offsetLeft + px + 14;
    const below = py + 20 + box.offsetHeight < clientHeight;
    box.style.left = `${Math.max(Math.min(at, clientWidth - box.offsetWidth), 0)}px`;
    box.style.top = `${below ? py + 18 : Math.max(py - 18 - box.offsetHeight, 0)}px`;
  }

  /** Draw the moment t of a run, and of a second run as ghosts. */
  draw({ run, ghost, t, pace, trails, picked, arrows, hits }) {
    this.ground ??= this.drawGround();
    this.pen.clearRect(0, 0, this.canvas.width, this.canvas.height);
    this.pen.drawImage(this.ground, 0, 0);
    this.under?.();
    for (const one of [ghost, run]) if (one && trails) this.drawTracks(one, t, one === run);
    const { shot, flash, drop } = this.content.look;
    if (ghost) this.drawBalls(ghost, t, drop * pace, null, GHOST);
    this.drawArrows(run, 1 - t / (shot * pace));
    this.drawFlashes(run, t, flash * pace);
    this.drawBalls(run, t, drop * pace, picked);
    if (ghost) this.drawRims(ghost, t);
    if (arrows) this.drawVelocities(run, t, hits);
    this.drawNames(run, t, picked);
    this.over?.();
  }

  // -- what stands still ----------------------------------------------------------------------

  drawGround() {
    const ground = new OffscreenCanvas(this.canvas.width, this.canvas.height);
    const pen = ground.getContext("2d");
    if (this.content.table) this.drawTable(pen);
    else this.drawPlane(pen);
    this.drawPatches(pen);
    for (const [x, y, radius, color] of this.content.discs) {
      this.disc(pen, x, y, radius, this.style[color]);
    }
    for (const [x, y, text] of this.content.numbers) {
      writeOver(pen, text, ...this.place(x, y), 11 * this.ratio);
    }
    return ground;
  }

  /** Return lines through points of the plane (m). */
  path(lines) {
    const path = new Path2D();
    for (const [first, ...others] of lines) {
      path.moveTo(...this.place(...first));
      for (const point of others) path.lineTo(...this.place(...point));
    }
    return path;
  }

  /** Draw rails, cushions and cloth, each as a wide stroke around what lies on it. */
  drawTable(pen) {
    const { outline, layers, shades, sights, sight } = this.content.table;
    const path = this.path([outline]);
    path.closePath();
    const stroke = (strokeStyle, width, lineJoin) => {
      Object.assign(pen, { strokeStyle, lineWidth: 2 * width * this.scale, lineJoin });
      pen.stroke(path);
    };
    for (const [color, width, join] of layers) stroke(this.style[color], width, join);
    pen.fillStyle = this.style.cloth;
    pen.fill(path);
    pen.save();
    pen.clip(path);
    for (const width of shades) stroke("rgb(0 0 0 / 5%)", width, "round");
    pen.restore();
    for (const [x, y] of sights) this.disc(pen, x, y, sight, this.style.sight);
  }

  /** Draw regions with other friction as a light tint on the cloth. */
  drawPatches(pen) {
    const { patches, table, look } = this.content;
    pen.save();
    if (table) pen.clip(this.path([table.outline]));
    pen.globalAlpha = look.tint;
    for (const [points, color] of patches) {
      pen.fillStyle = this.style[color];
      pen.fill(this.path([points]));
    }
    pen.restore();
  }

  /** Draw an open plane with a faint grid, and a bar that says how far its lines are apart. */
  drawPlane(pen) {
    const { lines, bar, text } = this.content.plane;
    const { style, ratio } = this;
    pen.fillStyle = style.plane;
    pen.fillRect(0, 0, this.canvas.width, this.canvas.height);
    Object.assign(pen, { strokeStyle: style.grid, lineWidth: ratio });
    pen.stroke(this.path(lines));
    Object.assign(pen, { strokeStyle: style.ink, lineWidth: 2 * ratio });
    pen.stroke(this.path([bar]));
    const [[x0, y], , , [x1]] = bar;
    const [x, top] = this.place((x0 + x1) / 2, y);
    writeOver(pen, text, x, top - 9 * ratio, 11 * ratio);
  }

  // -- what moves -----------------------------------------------------------------------------

  /** Draw the track of every ball up to the time t; it is strongest where the ball was last. A track
   * that others cover is drawn on them once more, slimmer and in one stroke. */
  drawTracks(run, t, solid) {
    const count = run.knots.length;
    const above = [];
    const { look, balls } = this.content;
    const thin = Math.sqrt(look.few / Math.max(count, look.few));
    const pieces = Math.min(Math.max(Math.floor(STROKES / count), FEWEST), look.pieces);
    balls.forEach(({ radius, color, halo }, i) => {
      const track = this.track(run, i, t, pieces);
      const size = (solid ? 2 : 1) * look.track * thin;
      const width = Math.max(size * radius * this.scale, 1.2 * this.ratio);
      if (solid && count <= CROWD && track.length)
        this.drawTrack([track.flat()], 1.5 * width, halo, look.halo, 1);
      this.drawTrack(track, width, color, solid ? 1 : 0.6);
      if (solid && count <= CROWD && track.length)
        above.unshift([[track.flat()], look.slim * width, color, 1]);
    });
    for (const layer of above.slice(1)) this.drawTrack(...layer);
  }

  /** Return the track of a ball up to the time t, at most up to its fall, in equal times. */
  track(run, i, t, pieces) {
    const end = Math.min(t, run.leaves[i], run.duration);
    const breakpoints = run.knots[i].filter(([time], k) => !k || time < end);
    if (!breakpoints.some(([, , , ...motion]) => motion.some(Boolean))) return [];
    const bends = bendTimes(breakpoints, end, 0.01 * this.content.balls[i].radius);
    return Array.from({ length: pieces }, (_, n) => {
      const [from, to] = [(n / pieces) * end, ((n + 1) / pieces) * end];
      const corners = bends.filter((time) => time > from && time < to);
      const states = [from, ...corners, to].map((time) => freeMotion(breakpoints, time));
      return states.map(({ x, y }) => [x, y]);
    });
  }

  /** Draw a track in pieces, each stronger than the one before; no seams show between them. */
  drawTrack(track, width, color, strength, oldest = this.content.look.oldest) {
    const ground = this.content.table ? this.style.cloth : this.style.plane;
    Object.assign(this.pen, { lineWidth: width, lineCap: "round", lineJoin: "round" });
    track.forEach((piece, n) => {
      const share = strength * (oldest + ((1 - oldest) * (n + 0.5)) / track.length);
      this.pen.strokeStyle = `color-mix(in srgb, ${color} ${100 * share}%, ${ground})`;
      this.pen.stroke(this.path([piece]));
    });
  }

  drawBalls(run, t, drop, picked, strength = 1) {
    const { flash } = this.style;
    statesAt(run, t).forEach(({ x, y, vx, vy }, i) => {
      const { radius } = this.content.balls[i];
      const shown = strength * (t >= run.leaves[i] ? 1 - (t - run.leaves[i]) / drop : 1);
      if (shown <= 0) return;
      if (vx || vy) this.ring(x, y, 1.08 * radius, 0.16 * radius, flash, 0.6 * shown);
      const sprite = this.sprites.get(i) ?? this.sprite(i);
      const [px, py] = this.place(x, y);
      this.pen.globalAlpha = shown;
      this.pen.drawImage(sprite, px - sprite.width / 2, py - sprite.height / 2);
      if (picked === i) this.ring(x, y, 1.35 * radius, 0.2 * radius, flash, 1);
    });
    this.pen.globalAlpha = 1;
  }

  /** Draw the rims of ghosts that ever move, which the balls must not hide. */
  drawRims(run, t) {
    statesAt(run, t).forEach(({ x, y }, i) => {
      const { radius, color, halo } = this.content.balls[i];
      const moves = run.knots[i].some(([, , , ...motion]) => motion.some(Boolean));
      if (!moves || t >= run.leaves[i]) return;
      this.ring(x, y, 0.9 * radius, 0.2 * radius, halo, 0.6);
      this.ring(x, y, 0.9 * radius, 0.1 * radius, color, 1);
    });
  }

  /** Write beside a ball a name that does not fit into it, unless the name covers another ball; the
   * picked ball always has its name, and in a crowd only that ball. */
  drawNames(run, t, picked) {
    const size = 10 * this.ratio;
    const discs = statesAt(run, t).map(({ x, y }, i) => {
      const there = t < run.leaves[i] && this.content.balls[i].radius * this.scale;
      return [...this.place(x, y), there];
    });
    discs.forEach(([x, y, radius], i) => {
      if (!radius || this.lettering(i).inside) return;
      const name = shortened(this.content.balls[i].id);
      this.pen.font = `bold ${size}px ${FONT}`;
      const [right, up] = [0.9 * radius, 0.8 * radius + 0.2 * size];
      const width = this.pen.measureText(name).width;
      const farthest = Math.hypot(right + width, up + 0.4 * size);
      const covers = ([x2, y2, r], k) => k !== i && r && Math.hypot(x2 - x, y2 - y) - r < farthest;
      const alone = discs.length <= CROWD && !discs.some(covers);
      if (alone || picked === i) writeOver(this.pen, name, x + right + width / 2, y - up, size);
    });
  }

  /** Return the sizes of a ball's letters and of the spot below them, and whether they fit. */
  lettering(i) {
    const { id, radius } = this.content.balls[i];
    const size = radius * this.scale;
    const spot = Math.min(Math.max(this.content.look.spot * size, 7.5 * this.ratio), 0.66 * size);
    const letter = Math.min((2.6 * spot) / Math.max(id.length, 2), 1.25 * spot);
    return { spot, letter, inside: letter > 7 * this.ratio };
  }

  /** Draw an arrow at every ball that moves at the start. */
  drawArrows(run, strength) {
    if (strength <= 0) return;
    const [x0, y0, x1, y1] = this.content.seen;
    const longest = LONGEST * Math.max(x1 - x0, y1 - y0);
    run.knots.forEach(([[, x, y, vx, vy]], i) => {
      const speed = Math.hypot(vx, vy);
      const { radius } = this.content.balls[i];
      const length = Math.min(this.content.look.arrow * speed, longest);
      const tip = 1.25 * radius + Math.max(length, 1.2 * radius);
      if (speed) this.drawArrow(x, y, vx / speed, vy / speed, radius, tip, 0.9 * strength);
    });
  }

  /** Draw the velocities of all balls, and of contacts the impulses, and the velocities before them.
   * An impulse is as long as the velocity that it gives a ball with the mass of the first one. */
  drawVelocities(run, t, hits) {
    const { arrow } = this.content.look;
    const draw = ([x, y], [u, v], radius, from, strength, color) => {
      const speed = Math.hypot(u, v);
      const tip = from + Math.max(arrow * speed, 0.9 * radius);
      if (speed) this.drawArrow(x, y, u / speed, v / speed, radius, tip, strength, { color, from });
    };
    const radius = (i) => this.content.balls[i].radius;
    const states = statesAt(run, t);
    for (const { balls, row } of hits) {
      row.before.forEach((v, n) => {
        const [i, { x, y }] = [balls[n], states[balls[n]]];
        draw([x, y], v, radius(i), radius(i), 0.45);
      });
    }
    states.forEach(({ x, y, vx, vy }, i) => {
      if (t < run.leaves[i]) draw([x, y], [vx, vy], radius(i), radius(i), 1);
    });
    for (const { balls, row, place } of hits) {
      row.impulses.forEach(([x, y], n) => {
        const velocity = [x / run.masses[0], y / run.masses[0]];
        draw(place, velocity, radius(balls[n]), 0, 1, this.style.impulse);
      });
    }
  }

  /** Draw an arrow from the rim of a ball along a unit vector; `tip` is measured from the centre.
   * A look has another colour, and the distance `from` the centre at which it begins. */
  drawArrow(x, y, ux, uy, radius, tip, globalAlpha, look = {}) {
    const { color = this.style.arrow, from = 1.25 * radius } = look;
    const { pen } = this;
    const at = (s, side) => [x + s * ux - side * uy, y + s * uy + side * ux];
    const size = Math.max(radius, (8 * this.ratio) / this.scale); // A small ball's arrow must show.
    const [back, side] = [tip - 0.6 * size, 0.28 * size];
    Object.assign(pen, { lineWidth: 0.12 * size * this.scale, lineCap: "round" });
    Object.assign(pen, { globalAlpha, strokeStyle: color, fillStyle: color });
    pen.stroke(this.path([[at(from, 0), at(tip - 0.5 * size, 0)]]));
    pen.fill(this.path([[at(tip, 0), at(back, side), at(back, -side)]]));
    pen.globalAlpha = 1;
  }

  /** Light up where contacts have just happened. */
  drawFlashes(run, t, life) {
    for (const { t: then, place } of run.events) {
      const age = (t - then) / life;
      if (!place || age < 0 || age >= 1) continue;
      const [x, y, radius] = place;
      const size = (0.3 + 1.2 * age) * radius;
      this.ring(x, y, size, 0.3 * radius, this.style.flash, 0.9 * (1 - age) ** 2);
    }
  }

  // -- balls ----------------------------------------------------------------------------------

  disc(pen, x, y, radius, color) {
    fillCircle(pen, ...this.place(x, y), radius * this.scale, color);
  }

  ring(x, y, radius, width, color, strength) {
    const { pen } = this;
    Object.assign(pen, { globalAlpha: strength, strokeStyle: color });
    pen.lineWidth = width * this.scale;
    pen.beginPath();
    pen.arc(...this.place(x, y), radius * this.scale, 0, 2 * Math.PI);
    pen.stroke();
    pen.globalAlpha = 1;
  }

  /** Draw a ball once, with shadow, light, and spot and label if they fit. */
  sprite(i) {
    const { look, ivory, balls } = this.content;
    const ball = balls[i];
    const radius = ball.radius * this.scale;
    const size = Math.ceil(1.4 * radius + 2);
    const sprite = new OffscreenCanvas(2 * size, 2 * size);
    const pen = sprite.getContext("2d");
    pen.translate(size, size);
    Object.assign(pen, { shadowColor: "rgb(0 0 0 / 45%)", shadowBlur: 0.3 * radius });
    Object.assign(pen, { shadowOffsetX: 0.1 * radius, shadowOffsetY: 0.14 * radius });
    fillCircle(pen, 0, 0, radius, this.style.outline);
    pen.shadowColor = "transparent";
    const inner = radius - Math.min(0.07 * radius, 1.6 * this.ratio);
    fillCircle(pen, 0, 0, inner, ball.striped ? ivory : ball.color);
    if (ball.striped) {
      pen.save();
      pen.clip(); // to the disc, which is still the path
      pen.fillStyle = ball.color;
      pen.fillRect(-radius, -look.stripe * radius, 2 * radius, 2 * look.stripe * radius);
      pen.restore();
    }
    const light = pen.createRadialGradient(-0.3 * radius, -0.36 * radius, 0, 0, 0, radius);
    light.addColorStop(0, "rgb(255 255 255 / 32%)");
    light.addColorStop(1, "rgb(255 255 255 / 0%)");
    fillCircle(pen, 0, 0, inner, light);
    const { spot, letter, inside } = this.lettering(i);
    if (inside) {
      fillCircle(pen, 0, 0, spot, "#ffffff");
      Object.assign(pen, { fillStyle: this.style.outline, font: `bold ${letter}px ${FONT}` });
      Object.assign(pen, { textAlign: "center", textBaseline: "middle" });
      pen.fillText(ball.id, 0, 0.06 * letter);
    }
    this.sprites.set(i, sprite);
    return sprite;
  }
}

/** Fill a circle; it stays the pen's path. */
function fillCircle(pen, x, y, radius, color) {
  pen.fillStyle = color;
  pen.beginPath();
  pen.arc(x, y, radius, 0, 2 * Math.PI);
  pen.fill();
}

/** Write words, centred at a point, so that they can be read on any ground. */
function writeOver(pen, text, x, y, size) {
  Object.assign(pen, { font: `bold ${size}px ${FONT}`, textAlign: "center", lineJoin: "round" });
  Object.assign(pen, { textBaseline: "middle", lineWidth: 0.3 * size });
  Object.assign(pen, { fillStyle: "#ffffff", strokeStyle: "rgb(0 0 0 / 70%)" });
  pen.strokeText(text, x, y);
  pen.fillText(text, x, y);
}

/** Stroke a path in a colour, [color, width], over a wider stroke in another. */
function strokeOver(pen, path, ...strokes) {
  for (const [strokeStyle, lineWidth] of strokes) {
    Object.assign(pen, { strokeStyle, lineWidth, lineJoin: "round" });
    pen.stroke(path);
  }
}

/** Give a canvas a size in CSS pixels, and return how many of its own pixels each of them has. */
function setSize(canvas, width, height) {
  const ratio = Math.min(window.devicePixelRatio || 1, 3);
  for (const [side, pixels] of Object.entries({ width, height })) {
    canvas.style[side] = `${Math.round(pixels)}px`;
    canvas[side] = Math.max(Math.round(ratio * Math.round(pixels)), 1);
  }
  return ratio;
}

/** Return a name that takes little room. */
function shortened(id) {
  const letters = Array.from(id);
  return letters.length > LETTERS ? `${letters.slice(0, LETTERS - 1).join("")}\u2026` : id;
}
