/* The controls: what is shown, when, and how fast. Everything that a file says is put on the page
 * as text, never as markup. */

const SPEEDS = [0.01, 0.03, 0.1, 0.25, 0.5, 1, 2, 4];
const MOST_EVENTS = 2000; // No more events than these are listed.
const NUDGE = 0.01; // s on the screen, or this share of a short run: the step of the keys , and .
const DIGITS = 4; // The clock shows at least this number of digits of a run's duration,
const DECIMALS = [3, 15]; // and no fewer and no more decimals than these.
const LOWEST = 140; // pixels; a table that is higher than wide is at least as high as this
const byId = (id) => document.getElementById(id);
const on = (id, kind, action) => byId(id).addEventListener(kind, action);

class Player {
  constructor(content) {
    this.table = new TableView(byId("table"));
    this.plot = new DistancePlot(byId("plot"));
    this.scheme = matchMedia("(prefers-color-scheme: dark)");
    this.dark = this.scheme.matches;
    // `frame` is the animation's next one, and `picked` the ball of which there is more to know.
    Object.assign(this, { speed: 1, time: 0, playing: false, frame: 0, picked: null });
    this.held = false; // A live table holds a ball, so nothing is picked,
    this.keepsPlot = false; // and keeps its size where there is no ghost.
    this.load(content);
    this.listen();
    new ResizeObserver(() => this.resize()).observe(byId("stage"));
  }

  // -- what is shown --------------------------------------------------------------------------

  /** Show a content: a scene, and runs of its shots, at first beside a ghost if there is one. */
  load(content, ghosts = true) {
    Object.assign(this, { content, ghosts });
    for (const run of content.shots.flatMap((shot) => shot.runs)) ready(run);
    byId("title").textContent = content.title;
    const names = content.shots.map((shot, k) => [k, `${k + 1}: ${shot.name}`]);
    fill("shot", names);
    byId("shot-label").hidden = content.shots.length < 2;
    byId("bar").hidden = byId("events").hidden = !content.shots.some((shot) => shot.runs[0].solver);
    this.choose(0);
  }

  /** Stop, and show a shot by its place from 0. */
  choose(k) {
    this.pause();
    this.shot = this.content.shots[k];
    this.run = this.shot.runs[0];
    byId("shot").value = k;
    const others = this.shot.runs.map((run, n) => [n, run.label]).slice(1);
    fill("ghost", [[0, "nothing"], ...others], others.length && this.ghosts ? 1 : 0);
    byId("ghost-label").hidden = !others.length;
    byId("setting").textContent = [isolated(this.shot.name), this.run.label, this.run.message]
      .filter(Boolean)
      .join("\u2002\u00b7\u2002");
    byId("warnings").replaceChildren(...this.run.warnings.map((text) => element("li", text)));
    this.listEvents();
    this.compare();
    this.seek(0);
  }

  /** Show the run that was chosen to compare with, or none. */
  compare() {
    const n = Number(byId("ghost").value);
    this.ghost = n ? this.shot.runs[n] : null;
    this.duration = Math.max(this.run.duration, this.ghost?.duration ?? 0);
    byId("time").max = this.duration || 1;
    this.time = Math.min(this.time, this.duration);
    byId("apart").hidden = !this.ghost;
    byId("apart-text").textContent =
      `How far every ball is from itself by ${this.ghost?.label} (its ghost)`;
    this.dress(this.dark);
  }

  /** Put on the colours of dark or light. */
  dress(dark) {
    this.dark = dark;
    this.style = this.content.styles[dark ? "dark" : "light"];
    const page = document.documentElement.style;
    for (const name of ["page", "ink", "faint"]) page.setProperty(`--${name}`, this.style[name]);
    page.colorScheme = dark ? "dark" : "light";
    this.table.show(this.content, this.style);
    if (this.ghost) this.plot.show(this.content, this.style, this.run, this.ghost, this.duration);
    this.resize();
  }

  listEvents() {
    const shown = this.run.events.slice(0, MOST_EVENTS);
    const decimals = this.decimals(this.run.duration) + 1;
    const last = `${(shown.at(-1)?.t ?? 0).toFixed(decimals)} s`;
    byId("events").style.setProperty("--letters", last.length);
    this.rows = shown.map((event) => {
      const parts = [`${event.t.toFixed(decimals)} s`, this.words(event)];
      const row = button(() => this.jump(event.t), ...parts.map((text) => element("span", text)));
      row.classList.toggle("quiet", !isMarked(event));
      return row;
    });
    const items = this.rows.map((row) => element("li", row));
    const unlisted = this.run.events.length - shown.length;
    if (unlisted) items.push(element("li", `${unlisted} more events are not listed.`));
    byId("events").replaceChildren(...items);
  }

  /** Say in words what happens. */
  words(event) {
    const [a, b] = event.balls.map((i) => this.name(i));
    const words = {
      "ball-ball": `meets ${b}`,
      "ball-cushion": `meets cushion ${event.cushion}`,
      pocket: `falls into ${isolated(event.pocket ?? "")}`,
      roll: "begins to roll",
    };
    return `${a} ${words[event.kind] ?? "stops"}`;
  }

  /** Return the name of a ball as it may stand between words. */
  name(i) {
    return isolated(this.content.balls[i].id);
  }

  // -- time -----------------------------------------------------------------------------------

  play() {
    if (this.playing || !this.duration) return;
    if (this.time >= this.duration) this.time = 0;
    this.playing = true;
    this.before = performance.now();
    this.mark();
    this.frame = requestAnimationFrame((now) => this.tick(now));
  }

  pause() {
    this.playing = false;
    cancelAnimationFrame(this.frame);
    this.mark();
  }

  tick(now) {
    const passed = Math.max(now - this.before, 0) / 1000;
    this.before = now;
    this.time = Math.min(this.time + passed * this.speed, this.duration);
    if (this.time >= this.duration) this.pause();
    this.draw();
    if (this.playing) this.frame = requestAnimationFrame((next) => this.tick(next));
  }

  seek(t) {
    this.time = Math.min(Math.max(t, 0), this.duration);
    this.draw();
  }

  /** Go by a little: a hundredth of a second on the screen, or of a run that is shorter than 1 s. */
  nudge(sign) {
    this.jump(this.time + sign * NUDGE * Math.min(this.duration, 1) * this.speed);
  }

  /** Return how many decimals the times of a run so long have. */
  decimals(duration) {
    const needed = DIGITS - 1 - Math.floor(Math.log10(duration || 1));
    return Math.min(Math.max(needed, DECIMALS[0]), DECIMALS[1]);
  }

  /** Stop at a time. */
  jump(t) {
    this.pause();
    this.seek(t);
  }

  /** Go to the contact before or after: to the start or to the end where there is none. */
  step(sign) {
    const times = this.run.events.filter(isMarked).map((event) => event.t);
    const next = times.find((t) => t > this.time) ?? this.duration;
    const last = times.findLast((t) => t < this.time) ?? 0;
    this.jump(sign > 0 ? next : last);
  }

  faster(sign) {
    this.setSpeed(SPEEDS[SPEEDS.indexOf(this.speed) + sign] ?? this.speed);
  }

  setSpeed(speed) {
    this.speed = byId("speed").value = speed;
    this.draw();
  }

  // -- the page -------------------------------------------------------------------------------

  resize() {
    const width = byId("stage").clientWidth;
    const others = byId("stage").getBoundingClientRect().top + byId("bar").offsetHeight + 24;
    const plot = this.ghost || this.keepsPlot ? 160 : 0;
    this.table.fit(width, Math.max(window.innerHeight - others - plot, LOWEST));
    if (this.ghost) this.plot.fit(width, plot - 24);
    this.drawTicks();
    this.draw();
  }

  draw() {
    const { run, ghost, time: t, speed: pace, picked } = this;
    this.table.draw({ run, ghost, t, pace, picked, trails: byId("trails").checked });
    if (ghost) this.plot.draw(t);
    byId("time").value = t;
    const decimals = this.decimals(this.duration) + (pace < 0.1 ? 1 : 0);
    byId("clock").textContent = `${t.toFixed(decimals)} s`;
    this.markEvents();
    this.tell();
  }

  mark() {
    byId("play").textContent = this.playing ? "\u275A\u275A" : "\u25B6\uFE0E";
    byId("play").setAttribute("aria-label", this.playing ? "Pause" : "Play");
  }

  /** Mark the contacts on the rail of time; the slider's knob is 16 pixels wide. */
  drawTicks() {
    const canvas = byId("ticks");
    const ratio = setSize(canvas, byId("rail").clientWidth, canvas.clientHeight);
    const pen = canvas.getContext("2d");
    const room = canvas.width - 16 * ratio;
    for (const event of this.run.events.filter(isMarked)) {
      const top = event.kind === "ball-cushion" ? 0.45 * canvas.height : 0;
      pen.fillStyle = event.pocket ? "#d55e00" : this.style.ink;
      const x = 8 * ratio + (event.t / (this.duration || 1)) * room;
      pen.fillRect(x - ratio / 2, top, ratio, canvas.height - top);
    }
  }

  /** Mark what has happened in the list, and keep it in sight. */
  markEvents() {
    const count = this.run.events.slice(0, MOST_EVENTS).filter((e) => e.t <= this.time).length;
    if (count === this.rows.marked) return;
    this.rows.marked = count;
    this.rows.forEach((row, k) => {
      row.classList.toggle("past", k < count);
      row.toggleAttribute("aria-current", k === count - 1);
    });
    const list = byId("events");
    const row = this.rows[Math.max(count - 1, 0)];
    if (row) list.scrollTop = row.offsetTop - list.offsetTop - list.clientHeight / 2;
    this.tellPocketed();
  }

  /** Say which balls are off the table. */
  tellPocketed() {
    const fallen = this.run.events.filter((e) => e.pocket && e.t <= this.time);
    const names = fallen.map((e) => `${this.name(e.balls[0])} (${isolated(e.pocket)})`);
    names.unshift(...this.run.off.map((i) => this.name(i)));
    byId("pocketed").hidden = !names.length;
    byId("pocketed").textContent = `Off the table: ${names.join(", ")}`;
  }

  /** Say what there is to know of the ball that is picked, beside it. */
  tell() {
    const box = byId("ball");
    box.hidden = this.picked === null;
    if (box.hidden) return;
    const { x, y, vx, vy } = stateAt(this.run, this.picked, this.time);
    const { length, speed } = this.content.units;
    const round = (value, [name, unit]) => `${(value / unit).toFixed(3)} ${name}`;
    const angle = ((Math.atan2(vy, vx) * 180) / Math.PI).toFixed(1);
    const fast = Math.hypot(vx, vy);
    const moves = fast ? `${round(fast, speed)} at ${angle}\u00b0` : "at rest";
    const name = isolated(shortened(this.content.balls[this.picked].id));
    box.textContent = `${name}: ${moves}\n${round(x, length)}, ${round(y, length)}`;
    this.table.putBeside(box, x, y);
  }

  /** Pick the ball under the pointer, or the nearest one within this distance (pixels). */
  pick(event, within) {
    if (this.held) return;
    const places = placesOf(statesAt(this.run, this.time));
    this.picked = this.table.nearest(event, places, within);
    if (!this.playing) this.draw();
  }

  listen() {
    const paces = SPEEDS.map((s) => [s, s < 1 ? `1/${Math.round(1 / s)}\u00d7` : `${s}\u00d7`]);
    fill("speed", paces, this.speed);
    on("play", "click", () => (this.playing ? this.pause() : this.play()));
    on("back", "click", () => this.step(-1));
    on("on", "click", () => this.step(1));
    on("time", "input", () => this.jump(byId("time").valueAsNumber));
    on("speed", "change", () => this.setSpeed(Number(byId("speed").value)));
    on("shot", "change", () => this.choose(Number(byId("shot").value)));
    on("ghost", "change", () => this.compare());
    on("trails", "change", () => this.draw());
    on("theme", "click", () => this.dress(!this.dark));
    on("plot", "pointerdown", (event) => this.jump(this.plot.time(event)));
    on("table", "pointermove", (event) => event.pointerType === "mouse" && this.pick(event, 2));
    on("table", "pointerdown", (event) => this.pick(event, event.pointerType === "mouse" ? 2 : 16));
    on("table", "pointerleave", (event) => {
      if (event.pointerType === "mouse") this.picked = null;
      this.draw();
    });
    document.addEventListener("keydown", (event) => this.key(event));
    window.addEventListener("resize", () => this.resize());
    this.scheme.addEventListener("change", () => this.dress(this.scheme.matches));
  }

  key(event) {
    if (event.target.closest("select, input:not([type=range]):not([type=checkbox])")) return;
    const pressed = event.target.closest("button, input[type=checkbox]");
    const k = Number(event.key) - 1;
    const action = actionOf(event, {
      " ": !pressed && (() => byId("play").click()),
      ArrowLeft: () => this.step(-1),
      ArrowRight: () => this.step(1),
      ",": () => this.nudge(-1),
      ".": () => this.nudge(1),
      Home: () => this.jump(0),
      End: () => this.jump(this.duration),
      "+": () => this.faster(1),
      "=": () => this.faster(1),
      "-": () => this.faster(-1),
      t: () => byId("trails").click(),
      d: () => byId("theme").click(),
      [k >= 0 && k < this.content.shots.length && event.key]: () => this.choose(k),
    });
    if (!action) return;
    event.preventDefault();
    action();
    if (!this.playing) this.draw();
  }
}

/** Return what a key does, if anything. */
function actionOf(event, actions) {
  if (event.ctrlKey || event.metaKey || event.altKey) return null;
  return actions[event.key] || actions[event.key.toLowerCase()];
}

/** Tell whether an event is a contact, or the fall of a ball. */
function isMarked(event) {
  return Boolean(event.place || event.pocket);
}

function element(kind, ...inside) {
  const made = document.createElement(kind);
  made.append(...inside);
  return made;
}

function button(action, ...inside) {
  const made = element("button", ...inside);
  made.type = "button";
  made.addEventListener("click", action);
  return made;
}

/** Offer choices [value, text] in a list, of which one is chosen. */
function fill(id, choices, chosen = choices[0]?.[0]) {
  byId(id).replaceChildren(...choices.map(([value, text]) => new Option(text, value)));
  byId(id).value = chosen ?? "";
}

/** Return a name that cannot turn round the words beside it, whatever its direction. */
function isolated(id) {
  const plain = /^[ -~\u00a0-\u058f]*$/.test(id); // letters that run from left to right
  return plain ? id : `\u2068${id.replace(/[\u2066-\u2069]/g, "")}\u2069`;
}

/** Make a run ready to be shown: numbers that are not finite came as null. */
function ready(run) {
  run.knots = run.knots.map((rows) => rows.map((row) => row.map((value) => value ?? NaN)));
  run.leaves = leavingTimes(run);
}
