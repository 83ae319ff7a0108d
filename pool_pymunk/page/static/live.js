/* The live table: aim, shoot, move balls. The page keeps where the balls lie and sends it with
 * every question; the server keeps nothing. A start is what a shot begins from: {position,
 * velocity, off}, in m and m/s, with the ids of the balls that are off the table. */

const WAY = 0.4; // of the width that is seen; a drag of this length is a full shot
const REACH = { mouse: 4, touch: 18 }; // pixels; so near to a ball does a press take it
const ANSWER = 40_000; // ms; the page waits so long for an answer,
const AGAIN = 1000; // and so long before it asks for a cloud again
const SOON = 250; // ms; an answer that takes longer is announced
const POINT = [0.09, 0.6, 1.3]; // the radius of an end, in that of its ball; its bounds in pixels
const EXACT = 1e-9; // m; ends that are nearer than this differ by rounding
const token = new URLSearchParams(location.search).get("token");

/** Questions of one kind: one is on its way at most, and of those that wait only the latest. */
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
      if (!this.next && answer !== null) this.take(answer, asked);
    }
    this.busy = false;
  }
}

class LiveTable {
  constructor(player) {
    this.player = player;
    this.table = player.table;
    this.content = player.content;
    this.choices = player.content.live;
    this.balls = player.content.balls;
    this.start = this.first = endOf(player);
    this.before = []; // what undo goes back to: starts, each with the aim there
    this.aim = { ball: this.choices.ball, speed: this.choices.speed, angle: this.choices.angle };
    this.last = null; // the question of the shot that is shown
    this.track = null; // the exact run of the aim
    this.drag = null;
    this.cloud = null;
    this.ghosts = true;
    this.aims = new Latest(
      (question) => this.ask("aim", question),
      (run, question) => this.takeTrack(run, question),
    );
    this.clouds = new Latest(
      (question) => this.askCloud(question),
      (cloud, question) => this.takeCloud(cloud, question),
    );
    player.keepsPlot = true;
    this.table.under = () => this.drawCloud();
    this.table.over = () => this.drawAim();
    this.tip = element("p");
    this.tip.id = "tip";
    byId("frame").append(this.tip);
    this.fillChoices();
    this.listen();
    this.rest();
  }

  // -- questions ------------------------------------------------------------------------------

  /** Ask the server; where there is no answer, say why and return null. */
  async ask(name, question) {
    let reply;
    let text;
    try {
      reply = await fetch(`/api/${name}`, {
        method: "POST",
        headers: { "content-type": "application/json", "x-pool-token": token },
        body: JSON.stringify(question),
        signal: AbortSignal.timeout(ANSWER),
      });
      text = await reply.text();
    } catch {
      this.say("The server does not answer. The table stays as it is: try again when it runs.");
      return null;
    }
    if (reply.ok) {
      this.say("");
      return name === "save" ? text : JSON.parse(text);
    }
    this.comesLater = name === "cloud" && (reply.status === 503 || reply.status === 429);
    if (!this.comesLater) this.say(problemsOf(text));
    return null;
  }

  say(text) {
    byId("message").textContent = text;
  }

  /** Return the question of the aimed shot. */
  question() {
    const { ball, speed, angle } = this.aim;
    return { ...this.start, ball: this.balls[ball].id, speed, angle, ...this.settings() };
  }

  settings() {
    const step = byId("step").value;
    return {
      solver: byId("solver").value,
      dt: step === "" ? null : Number(step),
      law: byId("law").value,
    };
  }

  // -- shots ----------------------------------------------------------------------------------

  /** Shoot as it is aimed. */
  async shoot() {
    const question = this.question();
    const from = { start: this.start, aim: { ...this.aim } };
    if (await this.playShot(question)) this.before.push(from);
    this.tellState();
  }

  /** Play the shot that is shown again, with the settings as they are now. */
  async again() {
    if (this.last && !this.track) await this.playShot({ ...this.last, ...this.settings() });
    else this.changeAim({});
  }

  /** Ask for a shot and play it; tell whether that went well. */
  async playShot(question) {
    if (this.shooting) return false;
    this.shooting = true;
    const slow = setTimeout(() => this.say("The server plays the shot \u2026"), SOON);
    const content = await this.ask("shot", question);
    clearTimeout(slow);
    this.shooting = false;
    if (!content) return false;
    this.last = question;
    this.content = content;
    this.track = this.aims.next = null;
    this.show(content);
    this.start = endOf(this.player);
    this.tellCost();
    this.tellState();
    this.player.play();
    this.wantCloud();
    return true;
  }

  /** Show a content; the ghost stays chosen or not. */
  show(content) {
    this.player.pause();
    const ghosts = this.ghosts;
    this.player.load(content);
    if (!ghosts) {
      byId("ghost").value = 0;
      this.player.compare();
    }
  }

  /** Show the balls where they lie, before a shot. */
  rest() {
    this.last = null;
    byId("cost").textContent = "";
    this.show({ ...this.content, shots: [{ name: "", runs: [resting(this.start, this.balls)] }] });
    this.tellState();
  }

  undo() {
    const from = this.before.pop();
    if (!from) return;
    this.start = from.start;
    this.rest();
    this.changeAim(from.aim);
  }

  reset() {
    this.before.push({ start: this.start, aim: { ...this.aim } });
    this.start = this.first;
    this.letBe();
  }

  /** Aim no more: show the balls where they lie. */
  letBe() {
    this.track = this.aims.next = this.drag = this.cloud = null;
    this.player.held = false;
    this.rest();
  }

  // -- aiming ---------------------------------------------------------------------------------

  /** Aim otherwise, and ask what the shot would do. */
  changeAim(aim) {
    Object.assign(this.aim, aim);
    if (this.last) this.rest();
    this.writeAim();
    this.aims.want(this.question());
    this.wantCloud();
  }

  takeTrack(run, question) {
    if (this.last || this.shooting) return;
    this.track = run;
    run.leaves = leavingTimes(run);
    run.struck = this.balls.findIndex((ball) => ball.id === question.ball);
    this.player.draw();
  }

  /** Return the speed and the angle of a drag from a ball to a point; null for none. */
  dragged(i, x, y) {
    const [x0, y0] = this.start.position[i];
    const way = Math.hypot(x - x0, y - y0) - this.balls[i].radius;
    if (way <= 0) return null;
    const { unit, grain } = { unit: this.unit(), grain: this.grain() };
    const share = Math.min(way / this.fullWay(), 1);
    const speed = Math.max(Math.round((share * this.choices.top) / unit / grain), 1) * grain;
    const angle = (Math.atan2(y - y0, x - x0) * 180) / Math.PI;
    return {
      ball: i,
      speed: +speed.toPrecision(9) * unit,
      angle: Math.round(angle * 100) / 100,
    };
  }

  /** Return how far (m) a drag goes from the rim of a ball for a full shot. */
  fullWay() {
    const [x0, , x1] = this.content.seen;
    return WAY * (x1 - x0);
  }

  unit() {
    return this.content.units.speed[1];
  }

  /** Return to how much a dragged speed is rounded, in the scenario's units. */
  grain() {
    return 10 ** Math.floor(Math.log10(this.choices.top / this.unit() / 100));
  }

  // -- the pointer ----------------------------------------------------------------------------

  press(event) {
    if (event.button !== 0 || this.shooting) return;
    if (this.last) this.player.jump(this.player.duration);
    const [x, y] = this.table.point(event.clientX, event.clientY);
    const i = this.ballAt(x, y, event.pointerType === "mouse" ? REACH.mouse : REACH.touch);
    if (i === null) return;
    event.preventDefault();
    document.activeElement?.blur();
    byId("table").setPointerCapture(event.pointerId);
    const moves = event.shiftKey || byId("move").getAttribute("aria-pressed") === "true";
    const [x0, y0] = this.start.position[i];
    this.drag = { i, moves, x: x0 - x, y: y0 - y, pointer: event.pointerId, aim: null, end: null };
    this.player.held = true;
    this.player.picked = null;
    if (this.last) this.rest();
  }

  /** Return the ball at a point, or the nearest within reach (pixels). */
  ballAt(x, y, reach) {
    const gaps = this.start.position.map(([px, py], i) =>
      this.start.off.includes(this.balls[i].id)
        ? Infinity
        : Math.hypot(px - x, py - y) - this.balls[i].radius,
    );
    const least = Math.min(...gaps);
    return (least * this.table.scale) / this.table.ratio <= reach ? gaps.indexOf(least) : null;
  }

  pull(event) {
    const { drag } = this;
    if (!drag || event.pointerId !== drag.pointer) return;
    const [x, y] = this.table.point(event.clientX, event.clientY);
    if (drag.moves) {
      drag.end = [x + drag.x, y + drag.y];
      const [, , , vx, vy] = this.player.run.knots[drag.i][0];
      this.player.run.knots[drag.i] = [[0, ...drag.end, vx, vy, 0, 0]];
    } else {
      drag.aim = this.dragged(drag.i, x, y);
      if (drag.aim) this.changeAim(drag.aim);
      else this.track = this.aims.next = null;
    }
    this.player.draw();
  }

  release(event) {
    const { drag } = this;
    if (!drag || event.pointerId !== drag.pointer) return;
    this.drag = null;
    this.player.held = false;
    if (drag.moves && drag.end) this.put(drag.i, drag.end);
    else if (drag.aim) this.shoot();
    else this.letBe();
  }

  // -- moving balls ---------------------------------------------------------------------------

  /** Put a ball to a place, if the server finds nothing wrong with it. */
  async put(i, place) {
    const { id } = this.balls[i];
    const start = {
      position: this.start.position.with(i, place),
      velocity: this.start.velocity.with(i, [0, 0]),
      off: this.start.off.filter((other) => other !== id),
    };
    const from = { start: this.start, aim: { ...this.aim } };
    if (await this.ask("place", { ...start, ball: id })) {
      this.before.push(from);
      this.start = start;
    }
    this.track = this.cloud = null;
    this.rest();
  }

  // -- copy and save --------------------------------------------------------------------------

  /** Copy the shot that is shown, or else the aimed one, as lines of a scenario file. */
  async copy() {
    const answer = await this.ask("scenario", this.last ?? this.question());
    if (!answer) return;
    try {
      await navigator.clipboard.writeText(answer.text);
      this.say(`Copied: ${answer.text.trim().split("\n").length} lines of a scenario file.`);
    } catch {
      this.say(answer.text);
    }
  }

  async save() {
    const text = await this.ask("save", this.last ?? this.question());
    if (!text) return;
    const link = element("a");
    link.href = URL.createObjectURL(new Blob([text], { type: "text/html" }));
    link.download = "shot.html";
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), ANSWER);
  }

  // -- the player's error ---------------------------------------------------------------------

  errors() {
    return {
      angle_error: Number(byId("angle-error").value),
      speed_error: Number(byId("speed-error").value) / 100,
    };
  }

  /** Ask where the balls end if the player errs, in the shot that is shown or aimed. */
  wantCloud() {
    const errors = this.errors();
    const { solver, dt, ...shot } = this.last ?? this.question();
    if (errors.angle_error || errors.speed_error) this.clouds.want({ ...shot, ...errors });
    else this.takeCloud(null);
  }

  /** Ask for a cloud, again and again while the server is not ready for it. */
  async askCloud(question) {
    this.comesLater = false;
    const cloud = await this.ask("cloud", question);
    if (cloud || !this.comesLater || this.clouds.next) return cloud;
    byId("cloud-text").textContent = "The server is getting ready for clouds \u2026";
    await new Promise((done) => setTimeout(done, AGAIN));
    this.clouds.next ??= question;
    return null;
  }

  takeCloud(cloud) {
    const errors = this.errors();
    this.cloud = errors.angle_error || errors.speed_error ? cloud : null;
    this.cloudLayer = null;
    const few = this.cloud && cloud.samples < this.choices.samples;
    const why = cloud?.compiled ? "these shots are hard" : "numba is not installed";
    byId("cloud-text").textContent = this.cloud
      ? `${cloud.samples} ends${few ? ` (${why})` : ""}; the errors are standard deviations`
      : "";
    this.player.draw();
  }

  tellErrors() {
    byId("angle-error-text").textContent = `${byId("angle-error").value}\u00b0`;
    byId("speed-error-text").textContent = `${byId("speed-error").value} %`;
  }

  // -- what is said ---------------------------------------------------------------------------

  /** Say what the solver and its step cost: how far a ball ends from its exact end. */
  tellCost() {
    const [run, exact] = this.player.shot.runs;
    const gaps = exact ? apart(run, exact, Math.max(run.duration, exact.duration)) : [];
    const most = Math.max(...gaps, 0);
    const [name, unit] = this.content.units.length;
    const far = `${+(most / unit).toPrecision(3)} ${name}`;
    const farthest = this.balls[gaps.indexOf(most)]?.id;
    byId("cost").textContent = !exact
      ? "This is the exact run."
      : most < EXACT
        ? "Every ball ends where it exactly ends, but for rounding."
        : `Ball ${isolated(farthest)} ends ${far} from its exact end.`;
  }

  /** Say which balls can be put back, and whether there is something to undo. */
  tellState() {
    byId("undo").disabled = !this.before.length;
    const balls = this.start.off.map((id) => {
      const button = element("button", shortened(id));
      button.type = "button";
      button.title = `Put ${isolated(id)} back to where the scenario has it`;
      const i = this.balls.findIndex((ball) => ball.id === id);
      button.addEventListener("click", () => this.put(i, this.first.position[i]));
      return button;
    });
    byId("off").replaceChildren("Put back: ", ...balls.flatMap((button) => [button, " "]));
  }

  // -- what is drawn --------------------------------------------------------------------------

  /** Draw the aimed shot: an arrow, and the exact ways up to the contact after the first hit. */
  drawAim() {
    byId("off").hidden = !this.start.off.length || this.player.playing;
    this.tip.hidden = !(this.drag?.aim && !this.drag.moves);
    if (this.last || this.drag?.moves) return;
    if (!this.drag?.aim && !this.track) return;
    const { ball, speed, angle } = this.aim;
    if (this.start.off.includes(this.balls[ball].id)) return;
    const turn = (angle * Math.PI) / 180;
    const [x, y] = this.start.position[ball];
    const { radius } = this.balls[ball];
    const tip = radius + Math.max((speed / this.choices.top) * this.fullWay(), 1.5 * radius);
    const [ux, uy] = [Math.cos(turn), Math.sin(turn)];
    this.table.pen.globalAlpha = 0.55;
    this.table.drawArrow(x, y, ux, uy, radius, tip);
    this.table.pen.globalAlpha = 1;
    if (this.track) this.drawTrack(this.track);
    if (!this.tip.hidden) this.tell(x + tip * ux, y + tip * uy);
  }

  /** Say speed and angle beyond the tip of the arrow. */
  tell(x, y) {
    const { speed, angle } = this.aim;
    const fast = +(speed / this.unit()).toPrecision(6);
    this.tip.textContent = `${fast} ${this.content.units.speed[0]} at ${angle.toFixed(1)}\u00b0`;
    const [px, py] = this.table.place(x, y).map((pixel) => pixel / this.table.ratio);
    const { offsetLeft, clientHeight } = byId("table");
    const wide = byId("frame").clientWidth - this.tip.offsetWidth;
    const left = Math.cos((angle * Math.PI) / 180) < 0 ? px - 14 - this.tip.offsetWidth : px + 14;
    this.tip.style.left = `${Math.max(Math.min(offsetLeft + left, wide), 0)}px`;
    this.tip.style.top = `${Math.max(Math.min(py + 14, clientHeight - 30), 0)}px`;
  }

  drawTrack(run) {
    const { table } = this;
    const isHit = (event) => event.kind === "ball-ball" && event.balls.includes(run.struck);
    const hit = run.events.find(isHit);
    const other = hit?.balls.find((i) => i !== run.struck);
    const ends = (event) =>
      hit &&
      event.t > hit.t &&
      event.kind !== "stop" &&
      event.balls.some((i) => i === run.struck || i === other);
    const t = run.events.find(ends)?.t ?? run.duration;
    for (const i of [run.struck, other].filter((ball) => ball !== undefined)) {
      const corners = table.corners(run.knots[i], t, stateAt(run, i, t));
      this.drawWay(corners, this.balls[i].color);
    }
    if (hit) {
      const { x, y } = stateAt(run, run.struck, hit.t);
      const { radius } = this.balls[run.struck];
      table.ring(x, y, 0.94 * radius, 0.12 * radius, table.style.flash, 1);
    }
  }

  /** Draw a dashed line through corners [x, y]. */
  drawWay(corners, color) {
    if (corners.length < 2) return;
    const { pen, ratio } = this.table;
    pen.save();
    pen.beginPath();
    trace(pen, corners);
    for (const [width, shade] of [
      [3.6, "rgb(0 0 0 / 35%)"],
      [2, color],
    ]) {
      pen.setLineDash([7 * ratio, 5 * ratio]);
      Object.assign(pen, { strokeStyle: shade, lineWidth: width * ratio, lineJoin: "round" });
      pen.stroke();
    }
    pen.restore();
  }

  /** Draw the cloud below the balls; it is drawn once for each size of the table. */
  drawCloud() {
    if (!this.cloud || this.drag?.moves) return;
    if (!this.cloudLayer || this.cloudGround !== this.table.ground) {
      this.cloudLayer = this.drawEnds();
      this.cloudGround = this.table.ground;
    }
    this.table.pen.drawImage(this.cloudLayer, 0, 0);
  }

  drawEnds() {
    const { canvas, ratio } = this.table;
    const layer = new OffscreenCanvas(canvas.width, canvas.height);
    const pen = layer.getContext("2d");
    const dots = (ends, radius) => {
      pen.beginPath();
      for (const [x, y] of ends) {
        const [px, py] = this.table.place(x, y);
        pen.moveTo(px + radius, py);
        pen.arc(px, py, radius, 0, 2 * Math.PI);
      }
      pen.fill();
    };
    const [share, least, most] = POINT;
    this.cloud.ends.forEach((ends, i) => {
      const { radius, color, halo } = this.balls[i];
      const size = Math.min(
        Math.max(share * radius * this.table.scale, least * ratio),
        most * ratio,
      );
      Object.assign(pen, { fillStyle: halo, globalAlpha: 0.25 });
      dots(ends, 2 * size);
      Object.assign(pen, { fillStyle: color, globalAlpha: 0.8 });
      dots(ends, size);
    });
    return layer;
  }

  // -- controls -------------------------------------------------------------------------------

  fillChoices() {
    const { choices } = this;
    const name = (one) => [one.name, one.name];
    fill(byId("solver"), choices.solvers.map(name));
    fill(
      byId("law"),
      choices.laws.map((law) => [law, law]),
    );
    byId("law").value = choices.law;
    fill(
      byId("aim-ball"),
      this.balls.map((ball, i) => [i, ball.id]),
    );
    this.writeAim();
    byId("aim-unit").textContent = this.content.units.speed[0];
    this.fillSteps();
    this.tellErrors();
  }

  /** Offer the steps of the solver. */
  fillSteps() {
    const solver = this.choices.solvers.find((one) => one.name === byId("solver").value);
    fill(byId("step"), solver.steps);
    byId("step").value = solver.dt ?? "";
    byId("step-label").hidden = !solver.steps.length;
    byId("solver").title = solver.about;
  }

  writeAim() {
    byId("aim-ball").value = this.aim.ball;
    byId("aim-angle").value = +this.aim.angle.toFixed(6);
    byId("aim-speed").value = +(this.aim.speed / this.unit()).toPrecision(9);
    this.written = this.fields();
  }

  fields() {
    return ["aim-ball", "aim-angle", "aim-speed"].map((id) => byId(id).value).join(" ");
  }

  /** Read what was typed, if anything was; a number that is none stays as it was. */
  typed() {
    if (this.fields() === this.written) return;
    const [angle, speed] = ["aim-angle", "aim-speed"].map((id) => byId(id).valueAsNumber);
    this.changeAim({
      ball: Number(byId("aim-ball").value),
      angle: Number.isFinite(angle) ? angle : this.aim.angle,
      speed: speed >= 0 ? speed * this.unit() : this.aim.speed,
    });
  }

  listen() {
    const on = (id, kind, action) => byId(id).addEventListener(kind, action);
    on("table", "pointerdown", (event) => this.press(event));
    on("table", "pointermove", (event) => this.pull(event));
    on("table", "pointerup", (event) => this.release(event));
    on("table", "pointercancel", () => this.drag && this.letBe());
    for (const id of ["aim-ball", "aim-angle", "aim-speed"]) on(id, "change", () => this.typed());
    on("solver", "change", () => {
      this.fillSteps();
      this.again();
    });
    on("step", "change", () => this.again());
    on("law", "change", () => this.again());
    on("ghost", "change", () => {
      this.ghosts = byId("ghost").value !== "0";
    });
    for (const id of ["angle-error", "speed-error"]) {
      on(id, "input", () => {
        this.tellErrors();
        this.wantCloud();
      });
    }
    on("shoot", "click", () => this.shoot());
    on("undo", "click", () => this.undo());
    on("reset", "click", () => this.reset());
    on("copy", "click", () => this.copy());
    on("save", "click", () => this.save());
    on("move", "click", () => {
      const moves = byId("move").getAttribute("aria-pressed") !== "true";
      byId("move").setAttribute("aria-pressed", moves);
    });
    document.addEventListener("keydown", (event) => this.key(event));
  }

  key(event) {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    const turn = (by) => this.changeAim({ angle: +(this.aim.angle + by).toFixed(6) });
    const actions = {
      "[": () => turn(0.1),
      "]": () => turn(-0.1),
      "{": () => turn(1),
      "}": () => turn(-1),
      u: () => this.undo(),
      r: () => this.reset(),
      m: () => byId("move").click(),
      Escape: () => this.letBe(),
      Enter: () => this.shoot(),
    };
    const action = actions[event.key] || actions[event.key.toLowerCase()];
    const pressed = event.target.closest("button") && event.key === "Enter";
    if (!action || pressed || event.target.closest("select")) return;
    if (event.target.matches("input[type=number]")) this.typed();
    event.preventDefault();
    action();
  }
}

/** Return where the balls lie after the run that is shown. */
function endOf(player) {
  const { run } = player;
  const balls = statesAt(run, run.duration);
  const gone = (_, i) => run.leaves[i] <= run.duration;
  return {
    position: balls.map(({ x, y }) => [x, y]),
    velocity: balls.map(({ vx, vy }) => [vx, vy]),
    off: player.content.balls.filter(gone).map((ball) => ball.id),
  };
}

/** Return a run in which nothing happens. */
function resting({ position, velocity, off }, balls) {
  const knots = position.map((place, i) => [[0, ...place, ...velocity[i], 0, 0]]);
  const gone = off.map((id) => balls.findIndex((ball) => ball.id === id));
  const nothing = { solver: "", label: "", message: "", warnings: [], events: [] };
  return { ...nothing, duration: 0, off: gone, knots };
}

/** Return what a refusal says, one line a problem. */
function problemsOf(text) {
  try {
    return JSON.parse(text).problems.join("\n");
  } catch {
    return text;
  }
}

const live = new LiveTable(player);
