/* The live table: aim, shoot, move balls. The page keeps where the balls lie and sends it with
 * every question; the server keeps nothing. A start is what a shot begins from: {position,
 * velocity, off, rolls}, in m and m/s, with the ids of the balls that are off the table, and null
 * for rolls where balls do not roll. */

const FULL = 0.4; // of the width that is seen; a drag of this length is a full shot
const PICKED = { mouse: 4, touch: 18 }; // pixels; a press takes a ball that is as near as this
const ANSWER = 310_000; // ms; the page waits no longer than this for an answer; the server waits 300 s
const SOON = 250; // ms; an answer that takes longer is announced
const PAUSE = 30; // ms; if the aim rests this long, the page asks for the shot before it is shot
const FRAME = 16; // ms; the first frame of a shot shows this time of it
const POINT = [0.09, 0.6, 1.3]; // the radius of an end in radii of its ball; its bounds in pixels
const EXACT = 1e-9; // m; ends that are nearer than this differ by rounding
const say = (text, id = "message") => byId(id).replaceChildren(text);
const AIM = ["aim-ball", "aim-angle", "aim-speed", "aim-roll"]; // the fields
const token = new URLSearchParams(location.search).get("token");

/** Questions of one kind: one at a time is asked, and only the latest of the others waits. */
class Latest {
  constructor(ask, take) {
    Object.assign(this, { ask, take, busy: false, next: null });
  }

  async want(question) {
    this.next = question;
    if (this.busy) return;
    this.busy = true;
    while (this.next) {
      const asked = this.next;
      this.next = null;
      const answer = await this.ask(asked);
      if (!this.next) this.take(answer, asked);
    }
    this.busy = false;
  }
}

class LiveTable {
  constructor(player) {
    const { table, content } = player;
    const { live, balls } = content;
    Object.assign(this, { player, table, content, balls, choices: live });
    this.still = player.run; // In it nothing happens.
    this.start = endOf(player);
    this.before = []; // what undo goes back to: starts, each with the aim there
    this.aim = { ball: live.ball, speed: live.speed, angle: live.angle, roll: live.roll };
    this.first = this.now();
    this.unit = content.units.speed[1];
    // `last` is the question of the shot that is shown, `track` the reference run of the aim.
    Object.assign(this, { last: null, track: null, drag: null, cloud: null, ghosts: true });
    this.aims = new Latest((one) => this.ask("aim", one), this.takeTrack.bind(this));
    this.clouds = new Latest((one) => this.ask("cloud", one), this.takeCloud.bind(this));
    player.keepsPlot = true;
    table.under = () => this.drawBelow();
    table.over = () => this.drawAim();
    this.tip = byId("frame").appendChild(element("p"));
    Object.assign(this.tip, { id: "tip", className: "note" });
    this.fillChoices();
    this.listen();
    this.goTo(this.first);
  }

  // -- questions ------------------------------------------------------------------------------

  /** Ask the server; where there is no answer, say why and return null. */
  async ask(name, question) {
    const place = name === "cloud" ? "cloud-text" : "message";
    const slow = setTimeout(() => say("The server is at work \u2026", place), SOON);
    const headers = { "content-type": "application/json", "x-pool-token": token };
    const [body, signal] = [JSON.stringify(question), AbortSignal.timeout(ANSWER)];
    const asked = fetch(`/api/${name}`, { method: "POST", headers, body, signal });
    const reply = await asked.catch(() => null);
    const text = await reply?.text().catch(() => null);
    clearTimeout(slow);
    say("", place);
    if (typeof text !== "string") {
      say("The server does not answer. The table stays as it is: try again when it runs.", place);
      return null;
    }
    if (reply.ok) return name === "save" ? text : JSON.parse(text);
    try {
      say(JSON.parse(text).problems.join("\n"), place);
    } catch {
      say(text, place);
    }
    return null;
  }

  /** Return the question of the aimed shot. */
  question() {
    return { ...this.start, ...this.aim, ball: this.balls[this.aim.ball].id, ...this.settings() };
  }

  settings() {
    const [solver, step, law] = ["solver", "step", "law"].map((id) => byId(id).value);
    return { solver, dt: step === "" ? null : Number(step), law };
  }

  // -- shots ----------------------------------------------------------------------------------

  /** Return what undo goes back to. */
  now() {
    return { start: this.start, aim: { ...this.aim } };
  }

  /** Shoot as it is aimed. */
  shoot() {
    this.typed();
    return this.playShot(this.question(), this.now());
  }

  /** Play the shown shot once more, with the settings as they are now. */
  async again() {
    if (this.last && !this.track) await this.playShot({ ...this.last, ...this.settings() });
    else this.changeAim({});
  }

  /** Ask for a shot, unless it has been asked for; a refused shot is asked for again. */
  async foresee(question) {
    const text = JSON.stringify(question);
    if (this.foreseen?.text !== text) this.foreseen = { text, answer: this.ask("shot", question) };
    const content = await this.foreseen.answer;
    if (!content) this.foreseen = null;
    return content;
  }

  /** Ask for a shot and play it; if `from` is given, undo goes back to it. */
  async playShot(question, ...from) {
    if (this.shooting) return;
    this.shooting = true;
    const content = await this.foresee(question);
    this.shooting = false;
    if (!content) return;
    this.before.push(...from);
    Object.assign(this, { last: question, content, track: null });
    this.aims.next = null;
    this.tellCost(content.shots[0].runs);
    this.player.load(content, this.ghosts);
    this.start = endOf(this.player);
    this.tellState();
    this.player.play();
    this.player.before -= FRAME;
    this.wantCloud();
  }

  /** Say how far a ball ends from its exact end; a run that is exact itself has no ghost. */
  tellCost(runs) {
    const [run, exact = run] = runs;
    const gaps = apart(run, exact, Math.max(run.duration, exact.duration));
    const most = Math.max(...gaps);
    const [name, unit] = this.content.units.length;
    const ball = isolated(this.balls[gaps.indexOf(most)]?.id ?? "");
    const cost = `Ball ${ball} ends ${+(most / unit).toPrecision(3)} ${name} from its exact end.`;
    byId("cost").textContent = most < EXACT ? "Exact, except for rounding." : cost;
    if (most < EXACT) runs.length = 1;
  }

  /** Say which balls can be put back, and whether there is something to undo. */
  tellState() {
    byId("undo").disabled = !this.before.length;
    const buttons = this.start.off.map((id) => {
      const i = this.balls.findIndex((ball) => ball.id === id);
      const made = button(() => this.put(i, this.first.start.position[i]), shortened(id));
      made.title = `Put ${isolated(id)} back to where the scenario has it`;
      return made;
    });
    byId("off").replaceChildren("Put back: ", ...buttons.flatMap((one) => [one, " "]));
  }

  /** Show the balls where they lie, before a shot. */
  rest() {
    this.last = null;
    byId("cost").textContent = "";
    const { position, velocity, off: ids } = this.start;
    const breakpoints = position.map((place, i) => [[0, ...place, ...velocity[i], 0, 0]]);
    const off = ids.map((id) => this.balls.findIndex((ball) => ball.id === id));
    const shots = [{ name: "", runs: [{ ...this.still, off, knots: breakpoints }] }];
    this.player.load({ ...this.content, shots }, this.ghosts);
    this.tellState();
  }

  /** Go to a start, with the aim there. */
  goTo({ start, aim }) {
    this.start = start;
    this.rest();
    this.changeAim(aim);
  }

  undo() {
    const from = this.before.pop();
    if (from) this.goTo(from);
  }

  reset() {
    this.before.push(this.now());
    this.goTo(this.first);
  }

  /** Aim no more: show the balls where they lie. */
  letBe() {
    this.track = this.aims.next = this.drag = this.cloud = null;
    this.player.held = false;
    this.rest();
  }

  // -- aiming ---------------------------------------------------------------------------------

  /** Change the aim, and ask what the shot would do. */
  changeAim(aim) {
    Object.assign(this.aim, aim);
    if (this.last) this.rest();
    this.writeAim();
    this.aims.want(this.question());
    this.wantCloud();
  }

  takeTrack(run, question) {
    if (this.last || this.shooting) return;
    if (run) run.leaves = leavingTimes(run);
    this.track = run;
    this.player.draw();
    const { exact, dt } = this.solver; // A slow shot would let the next aim wait.
    const isQuick = run && exact && dt === question.dt;
    setTimeout(() => isQuick && this.track === run && this.foresee(question), PAUSE);
  }

  /** Return the speed and the angle of a drag from a ball to a point; null for none. */
  dragged(ball, x, y) {
    const [x0, y0] = this.start.position[ball];
    const drag = Math.hypot(x - x0, y - y0) - this.balls[ball].radius;
    if (drag <= 0) return null;
    const top = this.choices.top / this.unit;
    const grain = 10 ** Math.floor(Math.log10(top / 100)); // a dragged speed is rounded to it
    const share = Math.min(drag / this.fullDrag(), 1);
    const speed = Math.max(Math.round((share * top) / grain), 1) * grain;
    const angle = (Math.atan2(y - y0, x - x0) * 180) / Math.PI;
    const rounded = Math.round(angle * 100) / 100;
    return { ball, speed: +speed.toPrecision(9) * this.unit, angle: rounded };
  }

  /** Return how far (m) a drag goes from the rim of a ball for a full shot. */
  fullDrag() {
    const [x0, , x1] = this.content.seen;
    return FULL * (x1 - x0);
  }

  // -- the pointer ----------------------------------------------------------------------------

  press(event) {
    if (event.button !== 0 || this.shooting) return;
    if (this.last) this.player.jump(this.player.duration);
    const { run, duration } = this.player;
    const within = PICKED[event.pointerType] ?? PICKED.touch;
    const i = this.table.nearest(event, run, duration, within);
    if (i === null) return;
    event.preventDefault();
    document.activeElement?.blur();
    byId("table").setPointerCapture(event.pointerId);
    const [x, y] = this.table.point(event);
    const moves = event.shiftKey || byId("move").ariaPressed === "true";
    const [x0, y0] = this.start.position[i];
    const grip = [x0 - x, y0 - y];
    this.drag = { i, moves, grip, pointer: event.pointerId, aim: null, end: null };
    if (moves) this.track = null;
    Object.assign(this.player, { held: true, picked: null });
    if (this.last) this.rest();
  }

  pull(event) {
    const { drag } = this;
    if (event.pointerId !== drag?.pointer) return;
    const [x, y] = this.table.point(event);
    if (drag.moves) {
      drag.end = [x + drag.grip[0], y + drag.grip[1]];
      const [, , , ...motion] = this.player.run.knots[drag.i][0];
      this.player.run.knots[drag.i] = [[0, ...drag.end, ...motion]];
    } else {
      drag.aim = this.dragged(drag.i, x, y);
      if (drag.aim) this.changeAim(drag.aim);
      else this.track = this.aims.next = null;
    }
    this.player.draw();
  }

  release(event) {
    const { drag } = this;
    if (event.pointerId !== drag?.pointer) return;
    this.drag = null;
    this.player.held = false;
    if (drag.moves && drag.end) this.put(drag.i, drag.end);
    else if (drag.aim) this.shoot();
    else this.letBe();
  }

  /** Put a ball at a place, if the server finds nothing wrong with the place. */
  async put(i, place) {
    const { id } = this.balls[i];
    const start = {
      position: this.start.position.with(i, place),
      velocity: this.start.velocity.with(i, [0, 0]),
      rolls: this.start.rolls?.with(i, [0, 0]) ?? null,
      off: this.start.off.filter((other) => other !== id),
    };
    const from = this.now();
    if (!(await this.ask("place", { ...start, ball: id }))) return this.letBe();
    this.before.push(from);
    this.goTo({ start, aim: {} });
  }

  // -- copy and save --------------------------------------------------------------------------

  /** Copy the shot that is shown, or else the aimed one, as lines of a scenario file. */
  async copy() {
    const answer = await this.ask("scenario", this.last ?? this.question());
    if (!answer) return;
    const copied = `Copied: ${answer.text.trim().split("\n").length} lines of a scenario file.`;
    const copying = navigator.clipboard.writeText(answer.text);
    say(await copying.then(() => copied).catch(() => answer.text));
  }

  async save() {
    const text = await this.ask("save", this.last ?? this.question());
    if (!text) return;
    const href = URL.createObjectURL(new Blob([text], { type: "text/html" }));
    Object.assign(element("a"), { href, download: "shot.html" }).click();
    setTimeout(() => URL.revokeObjectURL(href), ANSWER);
  }

  // -- the player's error ---------------------------------------------------------------------

  /** Ask where the balls end if the player errs, in the shot that is shown or aimed. */
  wantCloud() {
    const boxed = (what) => byId(`${what}-error-box`).valueAsNumber || 0;
    const [angle, speed] = ["angle", "speed"].map(boxed);
    this.errs = angle !== 0 || speed !== 0;
    const { solver, dt, ...shot } = this.last ?? this.question();
    if (this.errs) this.clouds.want({ ...shot, angle_error: angle, speed_error: speed / 100 });
    else this.takeCloud(null);
  }

  takeCloud(cloud) {
    const shown = [this.cloud, this.errs ? cloud : null];
    [this.cloud, this.cloudGround] = [shown[1], null];
    const few = this.cloud?.samples < this.choices.samples;
    const why = cloud?.compiled ? " (these shots are hard)" : " (the core is plain Python)";
    const ends = `${cloud?.samples} ends${few ? why : ""}; the errors are standard deviations`;
    if (this.cloud || !this.errs) say(this.cloud ? ends : "", "cloud-text");
    if (shown.some(Boolean)) this.player.draw();
  }

  // -- what is drawn --------------------------------------------------------------------------

  /** Draw the aimed shot as an arrow. */
  drawAim() {
    byId("off").hidden = !this.start.off.length || this.player.playing;
    this.tip.hidden = !this.drag?.aim;
    if (!this.drag?.aim && !this.track) return;
    const { ball, speed, angle } = this.aim;
    const { radius } = this.balls[ball];
    const turn = (angle * Math.PI) / 180;
    const [ux, uy] = [Math.cos(turn), Math.sin(turn)];
    const [x, y] = this.start.position[ball];
    const tip = radius + Math.max((speed / this.choices.top) * this.fullDrag(), 1.5 * radius);
    this.table.drawArrow(x, y, ux, uy, radius, tip, 0.55);
    const fast = +(speed / this.unit).toPrecision(6);
    this.tip.textContent = `${fast} ${this.content.units.speed[0]} at ${angle.toFixed(1)}\u00b0`;
  }

  /** Draw the exact tracks, dashed, of the struck ball and of the ball that it hits first, up to
   * the next contact of one of them, and a ring where the two meet. */
  drawTrack(run, struck) {
    const { table } = this;
    const hit = run.events.find((e) => e.kind === "ball-ball" && e.balls.includes(struck));
    const both = hit?.balls ?? [struck];
    const ends = (e) => e.t > hit?.t && isMarked(e) && e.balls.some((i) => both.includes(i));
    const t = run.events.find(ends)?.t ?? run.duration;
    const { pen, ratio } = table;
    pen.setLineDash([7 * ratio, 5 * ratio]);
    for (const i of both) {
      const path = table.path(table.track(run, i, t, 1));
      strokeOver(pen, path, ["rgb(0 0 0 / 35%)", 3.6 * ratio], [this.balls[i].color, 2 * ratio]);
    }
    pen.setLineDash([]);
    if (!hit) return;
    const { x, y } = stateAt(run, struck, hit.t);
    const { radius } = this.balls[struck];
    table.ring(x, y, 0.94 * radius, 0.12 * radius, table.style.flash, 1);
  }

  /** Draw below the balls: the aim's tracks, and the cloud, which a new ground makes anew. */
  drawBelow() {
    if (this.track) this.drawTrack(this.track, this.aim.ball);
    if (!this.cloud || this.drag?.moves) return;
    if (this.cloudGround !== this.table.ground) this.cloudLayer = this.drawEnds();
    this.cloudGround = this.table.ground;
    this.table.pen.drawImage(this.cloudLayer, 0, 0);
  }

  drawEnds() {
    const { canvas, ratio, scale } = this.table;
    const layer = new OffscreenCanvas(canvas.width, canvas.height);
    const pen = layer.getContext("2d");
    const dots = (ends, radius, fillStyle, globalAlpha) => {
      const path = new Path2D();
      for (const [x, y] of ends.map((end) => this.table.place(...end))) {
        path.moveTo(x + radius, y);
        path.arc(x, y, radius, 0, 2 * Math.PI);
      }
      Object.assign(pen, { fillStyle, globalAlpha });
      pen.fill(path);
    };
    const [share, least, most] = POINT;
    this.cloud.ends.forEach((ends, i) => {
      const { radius, color, halo } = this.balls[i];
      const size = Math.min(Math.max(share * radius * scale, least * ratio), most * ratio);
      dots(ends, 2 * size, halo, 0.25);
      dots(ends, size, color, 0.8);
    });
    return layer;
  }

  // -- controls -------------------------------------------------------------------------------

  fillChoices() {
    const { solvers, laws, law, roll } = this.choices;
    const named = (names) => names.map((name) => [name, name]);
    const names = solvers.map((one) => one.name);
    const ids = this.balls.map((ball, i) => [i, ball.id]);
    fill("solver", named(names));
    fill("law", named(laws), law);
    fill("aim-ball", ids);
    byId("roll").hidden = roll === null;
    byId("aim-unit").textContent = this.content.units.speed[0];
    this.fillSteps();
  }

  /** Offer the steps of the solver. */
  fillSteps() {
    const solver = this.choices.solvers.find((one) => one.name === byId("solver").value);
    this.solver = solver;
    fill("step", solver.steps, solver.dt);
    byId("step-label").hidden = !solver.steps.length;
    byId("solver").title = solver.about;
  }

  writeAim() {
    byId("aim-ball").value = this.aim.ball;
    byId("aim-angle").value = +this.aim.angle.toFixed(6);
    byId("aim-speed").value = +(this.aim.speed / this.unit).toPrecision(9);
    byId("aim-roll").value = byId("roll-slider").value = this.aim.roll;
    this.written = AIM.map((id) => byId(id).value).join(" ");
  }

  /** Read what was typed, if anything was; text that is no number changes nothing. */
  typed() {
    if (AIM.map((id) => byId(id).value).join(" ") === this.written) return;
    const [ball, angle, speed, roll] = AIM.map((id) => Number.parseFloat(byId(id).value));
    this.changeAim({
      ball,
      angle: Number.isFinite(angle) ? angle : this.aim.angle,
      speed: speed >= 0 ? speed * this.unit : this.aim.speed,
      roll: Number.isFinite(roll) ? roll : this.aim.roll,
    });
  }

  listen() {
    on("table", "pointerdown", (event) => this.press(event));
    on("table", "pointermove", (event) => this.pull(event));
    on("table", "pointerup", (event) => this.release(event));
    on("table", "pointercancel", () => this.drag && this.letBe());
    for (const id of AIM) on(id, "change", () => this.typed());
    on("roll-slider", "input", (event) => this.changeAim({ roll: event.target.valueAsNumber }));
    on("errors", "input", ({ target }) => {
      const isBox = target.type === "number"; // It and the slider before it follow each other.
      const other = isBox ? target.previousElementSibling : target.nextElementSibling;
      other.value = target.valueAsNumber || 0;
      this.wantCloud();
    });
    on("panel", "keydown", (event) => {
      const slides = event.target.type === "range" && /^(Arrow|Page|Home|End)/.test(event.key);
      if (slides) event.stopPropagation();
    });
    on("solver", "change", () => this.fillSteps());
    for (const id of ["solver", "step", "law"]) on(id, "change", () => this.again());
    on("ghost", "change", () => {
      this.ghosts = byId("ghost").value !== "0";
    });
    for (const id of ["shoot", "undo", "reset", "copy", "save"]) on(id, "click", () => this[id]());
    on("move", "click", () => {
      byId("move").ariaPressed = byId("move").ariaPressed !== "true";
    });
    document.addEventListener("keydown", (event) => this.key(event));
  }

  key(event) {
    if (event.target.closest("select")) return;
    const turn = (by) => {
      this.typed();
      this.changeAim({ angle: +(this.aim.angle + by).toFixed(6) });
    };
    obey(event, {
      "[": () => turn(0.1),
      "]": () => turn(-0.1),
      "{": () => turn(1),
      "}": () => turn(-1),
      u: () => this.undo(),
      r: () => this.reset(),
      m: () => byId("move").click(),
      Escape: () => this.letBe(),
      Enter: !event.target.closest("button, #errors") && (() => this.shoot()),
    });
  }
}

/** Return where the balls lie after the shown run, and how they move. */
function endOf({ run, content }) {
  const balls = statesAt(run, run.duration);
  const rolls = run.knots[0][0].length > 7 ? balls.map(({ wx, wy }) => [wx, wy]) : null;
  return {
    position: balls.map(({ x, y }) => [x, y]),
    velocity: balls.map(({ vx, vy }) => [vx, vy]),
    off: content.balls.filter((_, i) => run.leaves[i] <= run.duration).map((ball) => ball.id),
    rolls,
  };
}

const live = new LiveTable(player);
