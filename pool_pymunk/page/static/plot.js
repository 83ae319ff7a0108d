/* How far two runs of one shot are apart, ball by ball, against time. */

const SAMPLES = 400;

class DistancePlot {
  constructor(canvas) {
    this.canvas = canvas;
    this.pen = canvas.getContext("2d");
  }

  /** Work out the distances of the runs from each other, and the scale of the axis. */
  show(content, style, run, ghost, duration) {
    Object.assign(this, { content, style, duration: duration || 1 });
    const times = Array.from({ length: SAMPLES }, (_, k) => (k * this.duration) / (SAMPLES - 1));
    const unit = content.units.length[1];
    const gaps = times.map((t) => apart(run, ghost, t).map((gap) => gap / unit));
    this.curves = content.balls.map(({ color }, i) => {
      return { color, points: times.map((t, k) => [t, gaps[k][i]]) };
    });
    const { wide_range, decades } = content.look;
    const seen = gaps.flat().filter((d) => d > 0 && Number.isFinite(d));
    seen.sort((a, b) => a - b);
    const most = seen.at(-1) ?? 0;
    const least = Math.max(seen[0], decades * most);
    this.same = most === 0;
    this.log = !this.same && most / least > wide_range;
    this.low = this.log ? 10 ** Math.floor(Math.log10(least)) : 0;
    this.high = this.log ? 2 * most : 1.1 * (most || 1);
  }

  fit(width, height) {
    this.ratio = setSize(this.canvas, width, height);
    this.left = 58 * this.ratio;
    this.right = this.canvas.width - 12 * this.ratio;
    this.top = 10 * this.ratio;
    this.foot = this.canvas.height - 24 * this.ratio;
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

  y(d) {
    const share = this.log
      ? Math.log(Math.max(d, this.low) / this.low) / Math.log(this.high / this.low)
      : d / this.high;
    return this.foot - share * (this.foot - this.top);
  }

  /** Draw the curves; they are faint from the time t on. */
  draw(t) {
    const { pen, style, ratio, top } = this;
    const [now, height] = [this.x(t), this.foot - top];
    pen.clearRect(0, 0, this.canvas.width, this.canvas.height);
    this.drawAxes();
    for (const { color, points } of this.same ? [] : this.curves) {
      strokeOver(pen, this.curve(points), [style.faint, 3.2 * ratio], [color, 2 * ratio]);
    }
    Object.assign(pen, { fillStyle: style.page, globalAlpha: 0.7 });
    pen.fillRect(now, top - ratio, this.right - now + ratio, height);
    Object.assign(pen, { fillStyle: style.ink, globalAlpha: 1 });
    pen.fillRect(now - ratio, top, 2 * ratio, height);
  }

  /** Return a curve; where the distance is 0 a logarithmic axis has no place. */
  curve(points) {
    const path = new Path2D();
    let open = false;
    for (const [t, d] of points) {
      const there = Number.isFinite(d) && (d > 0 || !this.log);
      if (there) path[open ? "lineTo" : "moveTo"](this.x(t), this.y(d));
      open = there;
    }
    return path;
  }

  drawAxes() {
    const { pen, style, ratio } = this;
    const [unit] = this.content.units.length;
    const write = (text, x, y, textAlign, textBaseline = "middle") => {
      Object.assign(pen, { textAlign, textBaseline });
      pen.fillText(text, x, y);
    };
    Object.assign(pen, { fillStyle: style.ink, strokeStyle: style.faint, lineWidth: ratio });
    pen.font = `${11 * ratio}px ${FONT}`;
    (this.same ? [] : this.marks()).forEach((d, k, marks) => {
      pen.globalAlpha = 0.4;
      pen.stroke(new Path2D(`M ${this.left} ${this.y(d)} H ${this.right}`));
      pen.globalAlpha = 1;
      const number = d && (d < 1e-3 || d >= 1e4) ? d.toExponential(0) : String(+d.toPrecision(6));
      const text = k === marks.length - 1 ? `${number} ${unit}` : number;
      write(text, this.left - 6 * ratio, this.y(d), "right");
    });
    const below = this.canvas.height - 4 * ratio;
    write(`${+this.duration.toPrecision(4)} s`, this.right, below, "right", "bottom");
    write("0 s", this.left, below, "left", "bottom");
    const middle = [(this.left + this.right) / 2, (this.top + this.foot) / 2];
    if (this.same) write("the same in both, to the last digit", ...middle, "center");
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
