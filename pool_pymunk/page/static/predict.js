/* A page that asks: a shot stops just before its first contact, and a class points at where the
 * balls will go. What comes after it is shown once there is an answer for each of them. */

class AskingPlayer extends Player {
  constructor(content) {
    super(content);
    this.table.over = () => this.drawAnswers();
    this.draw();
  }

  /** Show a shot; one that is not answered yet ends before its first contact. */
  choose(k) {
    const shot = this.content.shots[k];
    shot.whole ??= shot.runs;
    shot.points ??= [];
    this.first = shot.whole[0].events.find((event) => event.row);
    this.points = shot.points;
    shot.runs = this.isAsking() ? shot.whole.map((run) => upTo(run, this.first.t)) : shot.whole;
    super.choose(k);
    this.ask();
  }

  /** Tell whether the present shot has a contact that is not answered yet. */
  isAsking() {
    return Boolean(this.first) && this.points.length < this.first.balls.length;
  }

  listen() {
    super.listen();
    on("table", "pointerdown", (event) => this.answer(event));
  }

  /** Take the point under the pointer for an answer; after the last one the shot goes on. */
  answer(event) {
    if (!this.isAsking()) return;
    this.jump(this.duration);
    this.points.push(this.table.point(event));
    if (this.isAsking()) return this.ask();
    this.choose(this.content.shots.indexOf(this.shot));
    this.jump(this.first.t);
    this.play();
  }

  /** Ask where a ball will go, or say how far the answers are off. */
  ask() {
    const { first, points, names } = this;
    byId("question").hidden = !first;
    if (!first) return;
    const who = this.words(first);
    if (this.isAsking()) {
      const name = names[first.balls[points.length]];
      const text = `Before ${who}: where will ${name} go? Point at the table.`;
      byId("question").textContent = text;
    } else {
      const said = first.balls.map((i, n) => `${names[i]} ${this.miss(i, n)}`);
      byId("question").textContent = `${who}: ${said.join("; ")}.`;
    }
    this.resize();
  }

  /** Say how the velocity of a ball after the contact differs from its answer. */
  miss(i, n) {
    const [vx, vy] = this.first.row.after[n];
    if (!Math.hypot(vx, vy)) return "stands still";
    const { x, y } = stateAt(this.run, i, this.first.t);
    const [ux, uy] = [this.points[n][0] - x, this.points[n][1] - y];
    const angle = Math.atan2(vx * uy - vy * ux, vx * ux + vy * uy);
    const off = Math.abs((angle * 180) / Math.PI).toFixed(1);
    return `goes ${off}\u00b0 from where you pointed`;
  }

  /** Draw a line from each ball, as it is at the contact, to its answer. */
  drawAnswers() {
    const { pen, ratio, content, style } = this.table;
    this.points.forEach((point, n) => {
      const i = this.first.balls[n];
      const { x, y } = stateAt(this.shot.whole[0], i, this.first.t);
      const path = this.table.path([[[x, y], point]]);
      const { color, radius } = content.balls[i];
      pen.setLineDash([5 * ratio, 4 * ratio]);
      strokeOver(pen, path, [style.flash, 4 * ratio], [color, 2 * ratio]);
      pen.setLineDash([]);
      this.table.ring(...point, 0.4 * radius, 0.15 * radius, style.flash, 1);
    });
  }
}

/** Return a run up to the instant before a time (s). */
function upTo(run, t) {
  const events = run.events.filter((event) => event.t < t);
  const before = t * (1 - Number.EPSILON);
  return { ...run, events, duration: before, message: "The first contact.", warnings: [] };
}
