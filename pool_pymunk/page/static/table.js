/* The table, the balls and their tracks on a canvas, with the look of the pictures and films. */

const FLASH = 0.22; // s on the screen; so long does a contact light up
const DROP = 0.35; // s on the screen; so long does a ball take to fall into a pocket
const ARROW = 0.08; // s; an arrow is as long as the way that a ball travels in this time,
const LONGEST = 0.25; // and at most this share of what is seen
const SHOT = 0.5; // s on the screen; in this time the arrow of the shot fades
const OLDEST = 0.25; // The oldest part of a track is as strong as this, the newest 1.
const PIECES = 40; // A track that fades consists of so many pieces,
const STROKES = 640; // of fewer if all tracks of a run had more than these,
const FEWEST = 3; // but of so many at least.
const CROWD = 30; // More balls than these have tracks without halos, and no names beside them.
const LETTERS = 40; // A name beside a ball has so many letters at most.
const CUSHION = 0.035; // the widths of the cushions and of the rail, in the table's shorter side
const RAIL = 0.075;
const FONT = '"DejaVu Sans", system-ui, sans-serif';

class TableView {
  constructor(canvas) {
    this.canvas = canvas;
    this.pen = canvas.getContext("2d");
    this.sprites = new Map();
    this.under = this.over = null; // These draw what a live table adds, below and above the balls.
  }

  /** Show another content, or the same in other colours; what looks the same is not drawn anew. */
  show(content, style) {
    const { seen, grid, table, pockets, balls } = content;
    const look = JSON.stringify([seen, grid, table, pockets, balls, style]);
    Object.assign(this, { content, style });
    if (look === this.look) return;
    this.look = look;
    this.ground = null;
    this.sprites.clear();
  }

  /** Make the canvas so wide and at most so high (CSS pixels) as what there is to see fits. */
  fit(width, height) {
    const [x0, y0, x1, y1] = this.content.seen;
    const ratio = Math.min(window.devicePixelRatio || 1, 3);
    const scale = Math.min(width / (x1 - x0), height / (y1 - y0));
    const size = [Math.round(scale * (x1 - x0)), Math.round(scale * (y1 - y0))];
    const pixels = size.map((side) => Math.max(Math.round(ratio * side), 1));
    this.canvas.style.width = `${size[0]}px`;
    this.canvas.style.height = `${size[1]}px`;
    if (this.scale === ratio * scale && this.ground) return;
    [this.canvas.width, this.canvas.height] = pixels;
    this.ratio = ratio;
    this.scale = ratio * scale; // canvas pixels a metre
    this.left = -this.scale * x0;
    this.bottom = this.scale * y1;
    this.ground = null;
    this.sprites.clear();
  }

  place(x, y) {
    return [this.left + this.scale * x, this.bottom - this.scale * y];
  }

  /** Return the point of the plane (m) under a point of the window. */
  point(clientX, clientY) {
    const box = this.canvas.getBoundingClientRect();
    const x = (clientX - box.left) * this.ratio;
    const y = (clientY - box.top) * this.ratio;
    return [(x - this.left) / this.scale, (this.bottom - y) / this.scale];
  }

  /** Draw the moment t of a run, and of a second run as ghosts. */
  draw({ run, ghost, t, pace, trails, picked }) {
    if (!this.ground) this.ground = this.drawGround();
    const pen = this.pen;
    pen.setTransform(1, 0, 0, 1, 0, 0);
    pen.clearRect(0, 0, this.canvas.width, this.canvas.height);
    pen.drawImage(this.ground, 0, 0);
    this.under?.();
    if (trails) {
      if (ghost) this.drawTracks(ghost, t, false);
      this.drawTracks(run, t, true);
    }
    if (ghost) this.drawGhosts(ghost, t);
    this.drawArrows(run, 1 - t / (SHOT * pace));
    this.drawFlashes(run, t, FLASH * pace);
    this.drawBalls(run, t, DROP * pace, picked);
    this.drawNames(run, t, picked);
    this.over?.();
  }

  // -- what stands still ----------------------------------------------------------------------

  drawGround() {
    const ground = new OffscreenCanvas(this.canvas.width, this.canvas.height);
    const pen = ground.getContext("2d");
    if (this.content.table) this.drawTable(pen);
    else this.drawPlane(pen);
    for (const { x, y, radius } of this.content.pockets) {
      this.disc(pen, x, y, radius, this.style.lip);
      this.disc(pen, x, y, 0.9 * radius, this.style.hole);
    }
    return ground;
  }

  /** Draw rails, cushions and cloth, each as a wide stroke around what lies on it. */
  drawTable(pen) {
    const { outline, short, sharp, sights } = this.content.table;
    const { style } = this;
    const size = this.scale * short;
    const join = sharp ? "round" : "miter";
    const path = new Path2D();
    trace(
      path,
      outline.map(([x, y]) => this.place(x, y)),
    );
    path.closePath();
    const stroke = (color, width, corners) => {
      Object.assign(pen, { strokeStyle: color, lineWidth: 2 * width, lineJoin: corners });
      pen.stroke(path);
    };
    stroke(style.rail_edge, (CUSHION + RAIL) * size, "round");
    stroke(style.rail, (CUSHION + RAIL - 0.006) * size, "round");
    stroke(style.inlay, (CUSHION + 0.006) * size, join);
    stroke(style.cushion, CUSHION * size, join);
    stroke(style.nose, 0.003 * size, join);
    pen.fillStyle = style.cloth;
    pen.fill(path);
    pen.save();
    pen.clip(path);
    for (let k = 1; k < 7; k += 1) stroke("rgb(0 0 0 / 5%)", 0.12 * k * CUSHION * size, "round");
    pen.restore();
    for (const [x, y] of sights) this.disc(pen, x, y, 0.007 * short, style.sight);
  }

  /** Draw an open plane with a faint grid, and a bar that says how far its lines are apart. */
  drawPlane(pen) {
    const { seen, grid } = this.content;
    const { style } = this;
    const { width, height } = this.canvas;
    pen.fillStyle = style.plane;
    pen.fillRect(0, 0, width, height);
    pen.strokeStyle = style.grid;
    pen.lineWidth = this.ratio;
    pen.beginPath();
    const lines = (low, high) => {
      const first = Math.ceil(low / grid.pitch);
      const count = Math.max(Math.floor(high / grid.pitch) - first + 1, 0);
      return Array.from({ length: count }, (_, k) => (first + k) * grid.pitch);
    };
    for (const x of lines(seen[0], seen[2])) {
      pen.moveTo(this.place(x, 0)[0], 0);
      pen.lineTo(this.place(x, 0)[0], height);
    }
    for (const y of lines(seen[1], seen[3])) {
      pen.moveTo(0, this.place(0, y)[1]);
      pen.lineTo(width, this.place(0, y)[1]);
    }
    pen.stroke();
    const letter = 12 * this.ratio;
    const [x, y, length] = [letter, height - letter, grid.pitch * this.scale];
    Object.assign(pen, { strokeStyle: style.ink, fillStyle: style.ink, lineWidth: 2 * this.ratio });
    pen.beginPath();
    pen.moveTo(x, y - letter / 3);
    pen.lineTo(x, y);
    pen.lineTo(x + length, y);
    pen.lineTo(x + length, y - letter / 3);
    pen.stroke();
    pen.font = `${letter}px ${FONT}`;
    pen.textAlign = "center";
    pen.fillText(grid.text, x + length / 2, y - letter / 2);
  }

  // -- what moves -----------------------------------------------------------------------------

  /** Draw the way of every ball up to the time t; it is strongest where the ball was last. */
  drawTracks(run, t, solid) {
    const states = statesAt(run, t);
    const count = run.knots.length;
    const thin = count > 8 ? 0.6 : 1;
    const pieces = Math.min(Math.max(Math.floor(STROKES / count), FEWEST), PIECES);
    run.knots.forEach((knots, i) => {
      const corners = this.corners(knots, t, states[i]);
      if (corners.length < 2) return;
      const { radius, color, halo } = this.content.balls[i];
      const width = Math.max((solid ? 0.48 : 0.24) * thin * radius * this.scale, 1.2 * this.ratio);
      if (solid && count <= CROWD) this.drawTrack(corners, pieces, 1.5 * width, halo, 0.25);
      this.drawTrack(corners, pieces, width, color, solid ? 0.75 : 0.5);
    });
  }

  /** Return the corners [x, y, t] of a ball's way up to the time t; its fall is no part of it. */
  corners(knots, t, now) {
    const passed = knots.filter(([time]) => time <= t);
    const jumps = ([time, x, y], [before, x0, y0]) => time === before && (x !== x0 || y !== y0);
    const fall = passed.findIndex((knot, k) => k > 0 && jumps(knot, passed[k - 1]));
    const way = fall < 0 ? [...passed, [t, now.x, now.y]] : passed.slice(0, fall);
    const found = [];
    for (const [time, x, y] of way) {
      const [px, py] = this.place(x, y);
      const last = found.at(-1);
      if (!last || Math.hypot(px - last[0], py - last[1]) > 0.5) found.push([px, py, time]);
    }
    return found;
  }

  /** Draw a way through corners [x, y, t] in pieces of equal time, each stronger than the last. */
  drawTrack(corners, pieces, width, color, strength) {
    const pen = this.pen;
    const [first, last] = [corners[0][2], corners.at(-1)[2]];
    Object.assign(pen, {
      strokeStyle: color,
      lineWidth: width,
      lineCap: "butt",
      lineJoin: "round",
    });
    let k = 1;
    pen.beginPath();
    pen.moveTo(...corners[0]);
    for (let n = 1; n <= pieces; n += 1) {
      const end = first + (n / pieces) * (last - first);
      for (; k < corners.length - 1 && corners[k][2] <= end; k += 1) pen.lineTo(...corners[k]);
      const point = between(corners[k - 1], corners[k], end);
      pen.lineTo(...point);
      pen.globalAlpha = strength * (OLDEST + ((1 - OLDEST) * (n - 0.5)) / pieces);
      pen.stroke();
      pen.beginPath();
      pen.moveTo(...point);
    }
    pen.globalAlpha = 1;
  }

  drawBalls(run, t, drop, picked) {
    const pen = this.pen;
    statesAt(run, t).forEach(({ x, y, vx, vy }, i) => {
      const { radius } = this.content.balls[i];
      const age = t >= run.leaves[i] ? (t - run.leaves[i]) / drop : 0;
      if (age >= 1) return;
      pen.globalAlpha = 1 - age;
      if (vx || vy)
        this.ring(x, y, 1.08 * radius, 0.16 * radius, this.style.flash, 0.6 * (1 - age));
      const sprite = this.sprites.get(i) ?? this.sprite(i);
      const [px, py] = this.place(x, y);
      pen.drawImage(sprite, px - sprite.width / 2, py - sprite.height / 2);
      if (picked === i) this.ring(x, y, 1.35 * radius, 0.2 * radius, this.style.flash, 1);
    });
    pen.globalAlpha = 1;
  }

  /** Write the labels that do not fit into their balls beside them; in a crowd only the picked. */
  drawNames(run, t, picked) {
    const pen = this.pen;
    const size = 10 * this.ratio;
    Object.assign(pen, { font: `bold ${size}px ${FONT}`, textAlign: "left", lineJoin: "round" });
    Object.assign(pen, {
      textBaseline: "middle",
      strokeStyle: "rgb(0 0 0 / 70%)",
      fillStyle: "#ffffff",
    });
    pen.lineWidth = 0.3 * size;
    statesAt(run, t).forEach(({ x, y }, i) => {
      const { id, radius } = this.content.balls[i];
      if (t >= run.leaves[i] || this.lettering(i).inside) return;
      if (run.knots.length > CROWD && picked !== i) return;
      const [px, py] = this.place(x + 0.9 * radius, y + 0.8 * radius);
      pen.strokeText(shortened(id), px, py - 0.2 * size);
      pen.fillText(shortened(id), px, py - 0.2 * size);
    });
  }

  /** Return the size of a ball's letters and of the spot that they stand on, if they fit there. */
  lettering(i) {
    const { id, radius } = this.content.balls[i];
    const size = radius * this.scale;
    const spot = Math.min(Math.max(0.5 * size, 5.5 * this.ratio), 0.72 * size);
    const letter = Math.min((2.6 * spot) / Math.max(id.length, 2), 1.25 * spot);
    return { spot, letter, inside: letter > 7 * this.ratio };
  }

  drawGhosts(run, t) {
    const pen = this.pen;
    statesAt(run, t).forEach(({ x, y }, i) => {
      if (t >= run.leaves[i]) return;
      const { radius, color } = this.content.balls[i];
      const width = Math.min(0.16 * radius * this.scale, 4 * this.ratio);
      pen.globalAlpha = 0.35;
      this.disc(pen, x, y, radius, "#ffffff");
      this.ring(x, y, radius - width / this.scale / 2, width / this.scale, color, 1);
      this.ring(x, y, radius, 0.25 * (width / this.scale), this.style.outline, 0.7);
    });
    pen.globalAlpha = 1;
  }

  /** Draw an arrow at every ball that moves at the start. */
  drawArrows(run, strength) {
    if (strength <= 0) return;
    const [x0, y0, x1, y1] = this.content.seen;
    const longest = LONGEST * Math.max(x1 - x0, y1 - y0);
    this.pen.globalAlpha = 0.9 * strength;
    run.knots.forEach(([[, x, y, vx, vy]], i) => {
      const speed = Math.hypot(vx, vy);
      const { radius } = this.content.balls[i];
      const tip = 1.25 * radius + Math.max(Math.min(ARROW * speed, longest), 1.2 * radius);
      if (speed) this.drawArrow(x, y, vx / speed, vy / speed, radius, tip);
    });
    this.pen.globalAlpha = 1;
  }

  /** Draw an arrow from the rim of a ball along a unit vector; its tip is so far from the centre. */
  drawArrow(x, y, ux, uy, radius, tip) {
    const pen = this.pen;
    const at = (s, side) => this.place(x + s * ux - side * uy, y + s * uy + side * ux);
    const arrow = { lineWidth: 0.12 * radius * this.scale, lineCap: "round", lineJoin: "round" };
    Object.assign(pen, arrow, { strokeStyle: this.style.arrow, fillStyle: this.style.arrow });
    pen.beginPath();
    pen.moveTo(...at(1.25 * radius, 0));
    pen.lineTo(...at(tip - 0.5 * radius, 0));
    pen.stroke();
    pen.beginPath();
    pen.moveTo(...at(tip, 0));
    pen.lineTo(...at(tip - 0.6 * radius, 0.28 * radius));
    pen.lineTo(...at(tip - 0.6 * radius, -0.28 * radius));
    pen.fill();
  }

  /** Light up where contacts have just happened. */
  drawFlashes(run, t, life) {
    for (const event of run.events) {
      if (event.t > t) break;
      if (event.kind === "stop" || event.kind === "pocket" || event.t <= t - life) continue;
      const { x, y, radius } = event.place;
      const age = (t - event.t) / life;
      this.ring(
        x,
        y,
        (0.3 + 1.2 * age) * radius,
        0.3 * radius,
        this.style.flash,
        0.9 * (1 - age) ** 2,
      );
    }
  }

  // -- strokes --------------------------------------------------------------------------------

  disc(pen, x, y, radius, color) {
    pen.fillStyle = color;
    pen.beginPath();
    pen.arc(...this.place(x, y), radius * this.scale, 0, 2 * Math.PI);
    pen.fill();
  }

  ring(x, y, radius, width, color, strength) {
    const pen = this.pen;
    const before = pen.globalAlpha;
    pen.globalAlpha = strength;
    pen.strokeStyle = color;
    pen.lineWidth = width * this.scale;
    pen.beginPath();
    pen.arc(...this.place(x, y), Math.max(radius, 0) * this.scale, 0, 2 * Math.PI);
    pen.stroke();
    pen.globalAlpha = before;
  }

  /** Draw a ball once, with shadow, light, and spot and label if they fit. */
  sprite(i) {
    const ball = this.content.balls[i];
    const radius = ball.radius * this.scale;
    const size = Math.ceil(1.4 * radius + 2);
    const sprite = new OffscreenCanvas(2 * size, 2 * size);
    const pen = sprite.getContext("2d");
    pen.translate(size, size);
    const circle = (r, color) => {
      pen.fillStyle = color;
      pen.beginPath();
      pen.arc(0, 0, r, 0, 2 * Math.PI);
      pen.fill();
    };
    pen.shadowColor = "rgb(0 0 0 / 45%)";
    pen.shadowBlur = 0.3 * radius;
    pen.shadowOffsetX = 0.1 * radius;
    pen.shadowOffsetY = 0.14 * radius;
    circle(radius, this.style.outline);
    pen.shadowColor = "transparent";
    const inner = radius - Math.min(0.07 * radius, 1.6 * this.ratio);
    circle(inner, ball.striped ? this.content.ivory : ball.color);
    if (ball.striped) this.stripe(pen, inner, 0.62 * radius, ball.color);
    const light = pen.createRadialGradient(-0.3 * radius, -0.36 * radius, 0, 0, 0, radius);
    light.addColorStop(0, "rgb(255 255 255 / 32%)");
    light.addColorStop(1, "rgb(255 255 255 / 0%)");
    circle(inner, light);
    this.name(pen, ball.id, this.lettering(i));
    this.sprites.set(i, sprite);
    return sprite;
  }

  stripe(pen, radius, half, color) {
    pen.save();
    pen.beginPath();
    pen.arc(0, 0, radius, 0, 2 * Math.PI);
    pen.clip();
    pen.fillStyle = color;
    pen.fillRect(-radius, -half, 2 * radius, 2 * half);
    pen.restore();
  }

  name(pen, id, { spot, letter, inside }) {
    if (!inside) return;
    pen.fillStyle = "#ffffff";
    pen.beginPath();
    pen.arc(0, 0, spot, 0, 2 * Math.PI);
    pen.fill();
    Object.assign(pen, { fillStyle: this.style.outline, font: `bold ${letter}px ${FONT}` });
    Object.assign(pen, { textAlign: "center", textBaseline: "middle" });
    pen.fillText(id, 0, 0.06 * letter);
  }
}

/** Go along a line through points. */
function trace(path, points) {
  path.moveTo(...points[0]);
  for (const point of points.slice(1)) path.lineTo(...point);
}

/** Return the point at a time on the line between two corners [x, y, t]. */
function between([x0, y0, t0], [x1, y1, t1], t) {
  const share = t1 > t0 ? Math.min((t - t0) / (t1 - t0), 1) : 1;
  return [x0 + share * (x1 - x0), y0 + share * (y1 - y0)];
}

/** Return a name that takes little room. */
function shortened(id) {
  const letters = Array.from(id);
  return letters.length > LETTERS ? `${letters.slice(0, LETTERS - 1).join("")}\u2026` : id;
}
