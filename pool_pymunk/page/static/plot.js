/* Curves against time: kinetic energies and momenta, and how far two runs of one shot are apart. */

const SAMPLES = 400; // of a curve, at even times
const HEIGHT = 110; // pixels
const evenTimes = (end) => Array.from({ length: SAMPLES }, (_, k) => (k / (SAMPLES - 1)) * end);

/** Return a value of a run as a curve, with points before and at each breakpoint up to its end. */
function curveOf(valueAt, run, duration, color, halo) {
  const breaks = new Set(run.knots.flat().flatMap(([t]) => (t <= duration ? [t] : [])));
  const both = [...breaks].flatMap((t) => [t * (1 - Number.EPSILON), t]);
  const times = [...evenTimes(duration), ...both].sort((a, b) => a - b);
  return { color, halo, points: times.map((t) => [t, valueAt(run, t)]) };
}

/** Return how far each ball is from itself in another run, as a curve; the unit is given in m. */
function distanceCurves(run, other, duration, balls, unit) {
  const times = evenTimes(duration);
  const gaps = times.map((t) => apart(run, other, t));
  return balls.map(({ id, ...looks }, i) => {
    return { ...looks, name: id, points: times.map((t, k) => [t, gaps[k][i] / unit]) };
  });
}

class Plot {
  constructor(canvas) {
    this.canvas = canvas;
    this.pen = canvas.getContext("2d");
    this.curves = [];
  }

  /** Take curves {color, halo, points [t, value]}, which may have dashes, in their widths; a look
   * allows a logarithmic axis. */
  show(curves, unit, duration, style, look = null) {
    Object.assign(this, { curves, unit, style, duration: duration || 1 });
    const values = curves.flatMap(({ points }) => points.map(([, value]) => value));
    const seen = values.filter((value) => value > 0 && Number.isFinite(value));
    const [low, most] = seen.reduce(([a, b], d) => [Math.min(a, d), Math.max(b, d)], [Infinity, 0]);
    const least = Math.max(low, (look?.decades ?? 0) * most);
    this.log = look !== null && most / least > look.wide_range;
    this.low = this.log ? 10 ** Math.floor(Math.log10(least)) : 0;
    this.high = this.log ? 2 * most : 1.1 * (most || 1);
  }

  fit() {
    this.ratio = setSize(this.canvas, this.canvas.parentElement.clientWidth, HEIGHT);
    this.left = 58 * this.ratio;
    this.right = this.canvas.width - 12 * this.ratio;
    this.top = 8 * this.ratio;
    this.foot = this.canvas.height - 20 * this.ratio;
  }

  /** Return the time under the pointer. */
  time({ clientX }) {
    const x = (clientX - this.canvas.getBoundingClientRect().left) * this.ratio;
    const share = (x - this.left) / (this.right - this.left);
    return Math.min(Math.max(share, 0), 1) * this.duration;
  }

  x(t) {
    return this.left + (t / this.duration) * (this.right - this.left);
  }

  y(value) {
    const share = this.log
      ? Math.log(Math.max(value, this.low) / this.low) / Math.log(this.high / this.low)
      : value / this.high;
    return this.foot - share * (this.foot - this.top);
  }

  /** Draw the curves, faint from the time t on; beside a picked one, the others are faint. */
  draw(t, picked = null) {
    const { pen, style, ratio, top } = this;
    if (!this.curves.length) return;
    const [now, height] = [this.x(t), this.foot - top];
    pen.clearRect(0, 0, this.canvas.width, this.canvas.height);
    this.drawAxes();
    this.curves.forEach(({ color, halo, points, dashes = [] }, k) => {
      pen.globalAlpha = (picked ?? k) === k ? 1 : 0.2;
      pen.setLineDash(dashes.map((each) => 2 * ratio * each));
      strokeOver(pen, this.curve(points), [halo, 4 * ratio], [color, 2 * ratio]);
    });
    pen.setLineDash([]);
    Object.assign(pen, { fillStyle: style.page, globalAlpha: 0.6 });
    pen.fillRect(now, top - ratio, this.right - now + ratio, height + 3 * ratio);
    Object.assign(pen, { fillStyle: style.ink, globalAlpha: 1 });
    pen.fillRect(now - ratio, top, 2 * ratio, height);
  }

  /** Return a curve as a path; it is broken at a value 0, which no logarithmic axis has. */
  curve(points) {
    const path = new Path2D();
    let line = "moveTo";
    for (const [t, value] of points) {
      const there = Number.isFinite(value) && (value > 0 || !this.log);
      if (there) path[line](this.x(t), this.y(value));
      line = there ? "lineTo" : "moveTo";
    }
    return path;
  }

  drawAxes() {
    const { pen, style, ratio, unit } = this;
    const write = (text, x, y, textAlign, textBaseline = "middle") => {
      Object.assign(pen, { textAlign, textBaseline });
      pen.fillText(text, x, y);
    };
    Object.assign(pen, { fillStyle: style.ink, strokeStyle: style.faint, lineWidth: ratio });
    pen.font = `${11 * ratio}px ${FONT}`;
    this.marks().forEach((d, k, marks) => {
      pen.globalAlpha = 0.4;
      pen.stroke(new Path2D(`M ${this.left} ${this.y(d)} H ${this.right}`));
      pen.globalAlpha = 1;
      const number = d && (d < 1e-3 || d >= 1e4) ? d.toExponential(0) : String(+d.toPrecision(6));
      const text = k === marks.length - 1 ? `${number} ${unit}` : number;
      write(text, this.left - 6 * ratio, this.y(d), "right");
    });
    const below = this.canvas.height - 2 * ratio;
    write("0 s", this.left, below, "left", "bottom");
    write(`${+this.duration.toPrecision(4)} s`, this.right, below, "right", "bottom");
  }

  /** Return the numbers that the axis is marked with: powers of ten, or a few round ones. */
  marks() {
    if (!this.log) {
      const power = 10 ** Math.floor(Math.log10(this.high / 2));
      const step = [5, 2, 1].map((k) => k * power).find((s) => this.high / s >= 2) ?? power;
      return Array.from({ length: Math.floor(this.high / step) + 1 }, (_, k) => k * step);
    }
    const [low, high] = [this.low, this.high].map((d) => Math.ceil(Math.log10(d) - 1e-9));
    const every = Math.max(Math.ceil((high - low) / 5), 1);
    const count = Math.ceil((high - low) / every);
    return Array.from({ length: count }, (_, k) => 10 ** (low + k * every));
  }
}
