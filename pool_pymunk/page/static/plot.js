/* How far two runs of one shot are apart, ball by ball, against time. */

const SAMPLES = 400;
const WIDE_RANGE = 30; // From this ratio of the largest to the smallest on, the axis is logarithmic.
const DECADES = 1e-6; // the least distance shown, in the largest

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
    this.curves = content.balls.map((ball, i) => ({
      color: ball.color,
      points: times.map((t) => [t, gapAt(run, ghost, i, t) / unit]),
    }));
    let [least, most] = [Infinity, 0];
    for (const { points } of this.curves) {
      for (const [, d] of points) {
        if (!(d > 0 && Number.isFinite(d))) continue;
        [least, most] = [Math.min(least, d), Math.max(most, d)];
      }
    }
    least = Math.max(least, DECADES * most);
    this.same = most === 0;
    this.log = !this.same && most / least > WIDE_RANGE;
    this.low = this.log ? 10 ** Math.floor(Math.log10(least)) : 0;
    this.high = this.log ? 2 * most : 1.1 * (most || 1);
  }

  fit(width, height) {
    this.ratio = Math.min(window.devicePixelRatio || 1, 3);
    this.canvas.style.width = `${width}px`;
    this.canvas.style.height = `${height}px`;
    this.canvas.width = Math.round(width * this.ratio);
    this.canvas.height = Math.round(height * this.ratio);
    this.left = 58 * this.ratio;
    this.right = this.canvas.width - 12 * this.ratio;
    this.top = 10 * this.ratio;
    this.foot = this.canvas.height - 24 * this.ratio;
  }

  /** Return the time under a point of the window. */
  time(clientX) {
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

  draw(t) {
    const { pen, style, ratio } = this;
    pen.clearRect(0, 0, this.canvas.width, this.canvas.height);
    this.drawAxes();
    if (this.same) {
      Object.assign(pen, { textAlign: "center", textBaseline: "middle", fillStyle: style.ink });
      const middle = [(this.left + this.right) / 2, (this.top + this.foot) / 2];
      pen.fillText("the same in both, to the last digit", ...middle);
    }
    for (const [first, last, strength] of [
      [0, this.duration, 0.3],
      [0, t, 1],
    ]) {
      pen.globalAlpha = strength;
      for (const { color, points } of this.same ? [] : this.curves) {
        for (const [wide, shade] of [
          [3.2, style.faint],
          [2, color],
        ]) {
          Object.assign(pen, { strokeStyle: shade, lineWidth: wide * ratio, lineJoin: "round" });
          this.drawCurve(points, first, last);
        }
      }
    }
    pen.globalAlpha = 1;
    pen.fillStyle = style.ink;
    pen.fillRect(this.x(t) - ratio, this.top, 2 * ratio, this.foot - this.top);
  }

  /** Draw a curve between two times; where the distance is 0 a logarithmic axis has no place. */
  drawCurve(points, first, last) {
    this.pen.beginPath();
    let open = false;
    for (const [t, d] of points) {
      const there = t >= first && t <= last && Number.isFinite(d) && (d > 0 || !this.log);
      if (there) this.pen[open ? "lineTo" : "moveTo"](this.x(t), this.y(d));
      open = there;
    }
    this.pen.stroke();
  }

  drawAxes() {
    const { pen, style, ratio } = this;
    Object.assign(pen, { fillStyle: style.ink, strokeStyle: style.faint, lineWidth: ratio });
    pen.font = `${11 * ratio}px ${FONT}`;
    pen.globalAlpha = 0.4;
    const marks = this.same ? [] : this.marks();
    for (const d of marks) {
      pen.beginPath();
      pen.moveTo(this.left, this.y(d));
      pen.lineTo(this.right, this.y(d));
      pen.stroke();
    }
    pen.globalAlpha = 1;
    Object.assign(pen, { textAlign: "right", textBaseline: "middle" });
    const unit = this.content.units.length[0];
    marks.forEach((d, k) => {
      const number = d && (d < 1e-3 || d >= 1e4) ? d.toExponential(0) : String(+d.toPrecision(6));
      pen.fillText(
        k === marks.length - 1 ? `${number} ${unit}` : number,
        this.left - 6 * ratio,
        this.y(d),
      );
    });
    pen.textBaseline = "bottom";
    pen.fillText(`${+this.duration.toPrecision(4)} s`, this.right, this.canvas.height - 4 * ratio);
    pen.textAlign = "left";
    pen.fillText("0 s", this.left, this.canvas.height - 4 * ratio);
  }

  /** Return the numbers that the axis is marked with: powers of ten, or a few round ones. */
  marks() {
    if (!this.log) {
      const power = 10 ** Math.floor(Math.log10(this.high / 2));
      const step = [5, 2, 1].map((k) => k * power).find((s) => this.high / s >= 2) ?? power;
      return Array.from({ length: Math.floor(this.high / step) + 1 }, (_, k) => k * step);
    }
    const [low, high] = [this.low, this.high].map((d) => Math.log10(d));
    const every = Math.max(Math.ceil((high - low) / 5), 1);
    const found = [];
    for (let k = Math.ceil(low - 1e-9); k <= high; k += every) found.push(10 ** k);
    return found;
  }
}
