/* The controls: what is shown, when, and how fast. Everything that a file says is put on the page
 * as text, never as markup. */

const SPEEDS = [0.01, 0.03, 0.1, 0.25, 0.5, 1, 2, 4];
const MOST_EVENTS = 2000; // So many events are listed at most.
const NUDGE = 0.01; // s on the screen; so far do the keys , and . go, or this share of a short run
const DIGITS = 4; // The clock shows at least so many digits of a run's duration,
const DECIMALS = [3, 15]; // and between so many decimals.
const LOWEST = 140; // pixels; a table that is higher than wide is at least so high
const byId = (id) => document.getElementById(id);

class Player {
  constructor(content) {
    this.table = new TableView(byId("table"));
    this.plot = new DistancePlot(byId("plot"));
    this.dark = matchMedia("(prefers-color-scheme: dark)").matches;
    this.speed = 1;
    this.time = 0;
    this.playing = false;
    this.frame = 0; // the animation's next frame
    this.picked = null;
    this.held = false; // A live table holds a ball, so nothing is picked,
    this.keepsPlot = false; // and keeps its size where there is no ghost.
    this.load(content);
    this.listen();
    new ResizeObserver(() => this.resize()).observe(byId("stage"));
  }

  // -- what is shown --------------------------------------------------------------------------

  /** Show a content: a scene, and runs of its shots. */
  load(content) {
    this.content = ready(content);
    byId("title").textContent = content.title;
    fill(
      byId("shot"),
      content.shots.map((shot, k) => [k, `${k + 1}: ${shot.name}`]),
    );
    byId("shot-label").hidden = content.shots.length < 2;
    byId("bar").hidden = byId("events").hidden = !content.shots.some((shot) => shot.runs[0].solver);
    this.choose(0);
  }

  /** Show a shot by its place from 0. */
  choose(k) {
    this.shot = this.content.shots[k];
    this.run = this.shot.runs[0];
    byId("shot").value = k;
    const others = this.shot.runs.map((run, n) => [n, run.label]).slice(1);
    fill(byId("ghost"), [[0, "nothing"], ...others]);
    byId("ghost-label").hidden = !others.length;
    byId("ghost").value = others.length ? 1 : 0;
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
    byId("apart").hidden = !this.ghost;
    if (this.ghost) {
      const text = `How far every ball is from itself by ${this.ghost.label} (its ghost)`;
      byId("apart-text").textContent = text;
    }
    this.dress();
  }

  /** Put on the colours of dark or light. */
  dress() {
    const style = this.content.styles[this.dark ? "dark" : "light"];
    for (const name of ["page", "ink", "faint"]) {
      document.documentElement.style.setProperty(`--${name}`, style[name]);
    }
    document.documentElement.style.colorScheme = this.dark ? "dark" : "light";
    this.table.show(this.content, style);
    if (this.ghost) this.plot.show(this.content, style, this.run, this.ghost, this.duration);
    this.resize();
  }

  listEvents() {
    const shown = this.run.events.slice(0, MOST_EVENTS);
    const decimals = this.decimals(this.run.duration) + 1;
    const last = `${(shown.at(-1)?.t ?? 0).toFixed(decimals)} s`;
    byId("events").style.setProperty("--letters", last.length);
    this.rows = shown.map((event) => {
      const row = element("button");
      row.type = "button";
      const time = element("span", `${event.t.toFixed(decimals)} s`);
      row.append(time, element("span", this.words(event)));
      row.classList.toggle("quiet", event.kind === "stop");
      row.addEventListener("click", () => this.jump(event.t));
      return row;
    });
    const items = this.rows.map((row) => {
      const item = element("li");
      item.append(row);
      return item;
    });
    const left = this.run.events.length - shown.length;
    if (left) items.push(element("li", `${left} more events are not listed.`));
    byId("events").replaceChildren(...items);
  }

  /** Say in words what happens. */
  words(event) {
    const [a, b] = event.balls.map((i) => isolated(this.content.balls[i].id));
    switch (event.kind) {
      case "ball-ball":
        return `${a} meets ${b}`;
      case "ball-cushion":
        return `${a} meets cushion ${event.cushion}`;
      case "pocket":
        return `${a} falls into ${isolated(event.pocket)}`;
      default:
        return `${a} stops`;
    }
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
  nudge(way) {
    this.jump(this.time + way * NUDGE * Math.min(this.duration, 1) * this.speed);
  }

  /** Return how many decimals the times of a run so long have. */
  decimals(duration) {
    const wanted = DIGITS - 1 - Math.floor(Math.log10(duration || 1));
    return Math.min(Math.max(wanted, DECIMALS[0]), DECIMALS[1]);
  }

  /** Stop at a time. */
  jump(t) {
    this.pause();
    this.seek(t);
  }

  /** Go to the contact before or after: to the start or to the end where there is none. */
  step(way) {
    const times = this.run.events.filter((event) => event.kind !== "stop").map((event) => event.t);
    const next = times.find((t) => t > this.time) ?? this.duration;
    const last = times.findLast((t) => t < this.time) ?? 0;
    this.jump(way > 0 ? next : last);
  }

  faster(way) {
    const k = SPEEDS.indexOf(this.speed) + way;
    this.speed = SPEEDS[Math.min(Math.max(k, 0), SPEEDS.length - 1)];
    byId("speed").value = this.speed;
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
    const ratio = window.devicePixelRatio || 1;
    canvas.width = Math.round(canvas.clientWidth * ratio);
    canvas.height = Math.round(canvas.clientHeight * ratio);
    const pen = canvas.getContext("2d");
    const style = this.content.styles[this.dark ? "dark" : "light"];
    const room = canvas.width - 16 * ratio;
    for (const event of this.run.events) {
      if (event.kind === "stop") continue;
      const hit = event.kind === "ball-cushion" ? 0.45 : 0;
      pen.fillStyle = event.kind === "pocket" ? "#d55e00" : style.ink;
      const x = 8 * ratio + (event.t / (this.duration || 1)) * room;
      pen.fillRect(x - ratio / 2, hit * canvas.height, ratio, (1 - hit) * canvas.height);
    }
  }

  /** Mark what has happened in the list, and keep it in sight. */
  markEvents() {
    const count = this.run.events.slice(0, MOST_EVENTS).filter((e) => e.t <= this.time).length;
    if (count === this.marked && this.rows === this.markedRows) return;
    this.rows.forEach((row, k) => {
      row.classList.toggle("past", k < count);
      row.toggleAttribute("aria-current", k === count - 1);
    });
    const list = byId("events");
    const row = this.rows[Math.max(count - 1, 0)];
    if (row) list.scrollTop = row.offsetTop - list.offsetTop - list.clientHeight / 2;
    [this.marked, this.markedRows] = [count, this.rows];
    this.tellPocketed();
  }

  /** Say which balls are off the table. */
  tellPocketed() {
    const name = (i) => isolated(this.content.balls[i].id);
    const fallen = this.run.events.filter((e) => e.kind === "pocket" && e.t <= this.time);
    const names = [
      ...this.run.off.map(name),
      ...fallen.map((e) => `${name(e.balls[0])} (${isolated(e.pocket)})`),
    ];
    byId("pocketed").hidden = !names.length;
    byId("pocketed").textContent = `Off the table: ${names.join(", ")}`;
  }

  /** Say what there is to know of the ball that is picked, beside it. */
  tell() {
    const box = byId("ball");
    box.hidden = this.picked === null;
    if (box.hidden) return;
    const { x, y, vx, vy } = statesAt(this.run, this.time)[this.picked];
    const { length, speed } = this.content.units;
    const round = (value, unit) => `${(value / unit[1]).toFixed(3)} ${unit[0]}`;
    const angle = ((Math.atan2(vy, vx) * 180) / Math.PI).toFixed(1);
    const fast = Math.hypot(vx, vy);
    const moves = fast ? `${round(fast, speed)} at ${angle}\u00b0` : "at rest";
    const place = `${round(x, length)}, ${round(y, length)}`;
    const name = isolated(shortened(this.content.balls[this.picked].id));
    box.textContent = `${name}: ${moves}\n${place}`;
    const [px, py] = this.table.place(x, y).map((pixel) => pixel / this.table.ratio);
    const offset = byId("table").offsetLeft;
    const wide = byId("frame").clientWidth - box.offsetWidth;
    const below = py + 20 + box.offsetHeight < byId("frame").clientHeight;
    box.style.left = `${Math.max(Math.min(offset + px + 14, wide), 0)}px`;
    box.style.top = `${below ? py + 18 : Math.max(py - 18 - box.offsetHeight, 0)}px`;
  }

  /** Pick the ball under the pointer, or the one that is nearest to it within reach (pixels). */
  pick(event, reach) {
    if (this.held) return;
    const [x, y] = this.table.point(event.clientX, event.clientY);
    const gaps = statesAt(this.run, this.time).map(
      (ball, i) => Math.hypot(ball.x - x, ball.y - y) - this.content.balls[i].radius,
    );
    const least = Math.min(...gaps);
    this.picked =
      (least * this.table.scale) / this.table.ratio <= reach ? gaps.indexOf(least) : null;
    if (!this.playing) this.draw();
  }

  listen() {
    fill(
      byId("speed"),
      SPEEDS.map((s) => [s, s < 1 ? `1/${Math.round(1 / s)}\u00d7` : `${s}\u00d7`]),
    );
    byId("speed").value = this.speed;
    const on = (id, kind, action) => byId(id).addEventListener(kind, action);
    on("play", "click", () => (this.playing ? this.pause() : this.play()));
    on("back", "click", () => this.step(-1));
    on("on", "click", () => this.step(1));
    on("time", "input", () => this.jump(Number(byId("time").value)));
    on("speed", "change", () => {
      this.speed = Number(byId("speed").value);
      this.draw();
    });
    on("shot", "change", () => {
      this.pause();
      this.choose(Number(byId("shot").value));
    });
    on("ghost", "change", () => {
      this.compare();
      this.seek(this.time);
    });
    on("trails", "change", () => this.draw());
    on("theme", "click", () => {
      this.dark = !this.dark;
      this.dress();
    });
    on("plot", "pointerdown", (event) => this.jump(this.plot.time(event.clientX)));
    on("table", "pointermove", (event) => event.pointerType === "mouse" && this.pick(event, 2));
    on("table", "pointerdown", (event) => this.pick(event, event.pointerType === "mouse" ? 2 : 16));
    on("table", "pointerleave", (event) => {
      if (event.pointerType === "mouse") this.picked = null;
      this.draw();
    });
    document.addEventListener("keydown", (event) => this.key(event));
    window.addEventListener("resize", () => this.resize());
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", (event) => {
      this.dark = event.matches;
      this.dress();
    });
  }

  key(event) {
    const typing = event.target.closest("select, input:not([type=range]):not([type=checkbox])");
    if (typing || event.ctrlKey || event.metaKey || event.altKey) return;
    const pressed = event.target.closest("button, input[type=checkbox]");
    const actions = {
      " ": () => (this.playing ? this.pause() : this.play()),
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
    };
    const k = Number(event.key) - 1;
    const choose =
      k >= 0 &&
      k < this.content.shots.length &&
      (() => {
        this.pause();
        this.choose(k);
      });
    const action = actions[event.key] || actions[event.key.toLowerCase()] || choose;
    if (!action || (pressed && event.key === " ")) return;
    event.preventDefault();
    action();
    if (!this.playing) this.draw();
  }
}

function element(kind, text = "") {
  const made = document.createElement(kind);
  made.textContent = text;
  return made;
}

function fill(select, choices) {
  select.replaceChildren(
    ...choices.map(([value, text]) => {
      const option = element("option", text);
      option.value = value;
      return option;
    }),
  );
}

/** Return a name that cannot turn round the words beside it, whatever its direction. */
function isolated(id) {
  const plain = /^[ -~\u00a0-\u058f]*$/.test(id); // letters that run from left to right
  return plain ? id : `\u2068${id.replace(/[\u2066-\u2069]/g, "")}\u2069`;
}

/** Make a content ready to be shown: numbers that are not finite came as null. */
function ready(content) {
  for (const run of content.shots.flatMap((shot) => shot.runs)) {
    run.knots = run.knots.map((knots) => knots.map((knot) => knot.map((value) => value ?? NaN)));
    run.leaves = leavingTimes(run);
    for (const event of run.events) event.place = contactPlace(content, run, event);
  }
  return content;
}
