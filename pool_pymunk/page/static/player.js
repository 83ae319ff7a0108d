/* The controls: what is shown, when, and how fast. Everything that a file says is put on the page
 * as text, never as markup. */

const SPEEDS = [0.01, 0.03, 0.1, 0.25, 0.5, 1, 2, 4];
const MOST_EVENTS = 2000; // No more events than these are listed.
const NUDGE = 0.01; // s on the screen, or this share of a short run: the step of the keys , and .
const LOWEST = 140; // pixels; a table that is higher than wide is at least as high as this
const KEPT = 170; // pixels; a live table keeps this room for plots, and for the words above them
const byId = (id) => document.getElementById(id);
const on = (id, kind, action) => byId(id).addEventListener(kind, action);

class Player {
  constructor(content) {
    this.table = new TableView(byId("table"));
    this.plots = ["energy-plot", "momentum-plot", "plot"].map((id) => new Plot(byId(id)));
    this.scheme = matchMedia("(prefers-color-scheme: dark)");
    this.dark = this.scheme.matches;
    // `frame` is the animation's next one, `picked` the ball whose motion is written beside it,
    // `opened` a list that the pointer has opened. While a live table has `held` a ball, no ball
    // is picked; `keepsPlot` keeps the room of the plots where there are none.
    Object.assign(this, { speed: 1, time: 0, playing: false, frame: 0, picked: null });
    Object.assign(this, { opened: null, held: false, keepsPlot: false });
    this.load(content);
    this.listen();
    new ResizeObserver(() => this.resize()).observe(byId("stage"));
  }

  // -- what is shown --------------------------------------------------------------------------

  /** Show a content: a scene, and runs of its shots, at first beside a ghost if there is one. */
  load(content, ghosts = true) {
    Object.assign(this, { content, beside: ghosts ? 1 : 0 });
    for (const run of content.shots.flatMap((shot) => shot.runs)) {
      const finite = (row) => row.map((value) => value ?? NaN); // Infinite numbers came as null.
      run.knots = run.knots.map((rows) => rows.map(finite));
      run.leaves = leavingTimes(run);
    }
    byId("title").textContent = content.title;
    const names = content.shots.map((shot, k) => [k, `${k + 1}: ${shot.name}`]);
    fill("shot", names);
    this.names = content.balls.map(({ id }) => isolated(id));
    byId("shot-label").hidden = byId("shot-keys").hidden = content.shots.length < 2;
    byId("last-shot").textContent = Math.min(content.shots.length, 9);
    const still = !content.shots.some((shot) => shot.runs[0].solver);
    byId("bar").hidden = byId("events").hidden = byId("plots").hidden = still;
    this.choose(0);
  }

  /** Stop, and show a shot by its place from 0. */
  choose(k) {
    this.pause();
    this.shot = this.content.shots[k];
    this.run = this.shot.runs[0];
    byId("shot").value = k;
    const others = this.shot.runs.map((run, n) => [n, run.label]).slice(1);
    fill("ghost", [[0, "nothing"], ...others], Math.min(this.beside, others.length));
    byId("ghost-label").hidden = !others.length;
    const said = [isolated(this.shot.name), this.run.setting];
    byId("setting").textContent = said.filter(Boolean).join("\u2002\u00b7\u2002");
    byId("warnings").replaceChildren(...this.run.warnings.map((text) => element("li", text)));
    this.listEvents();
    this.compare();
    this.jump(0);
  }

  /** Show the run that was chosen to compare with, or none. */
  compare() {
    this.beside = Number(byId("ghost").value);
    this.ghost = this.beside ? this.shot.runs[this.beside] : null;
    this.duration = Math.max(this.run.duration, this.ghost?.duration ?? 0);
    byId("time").max = this.duration || 1;
    this.time = Math.min(this.time, this.duration);
    byId("apart").hidden = !this.ghost;
    byId("apart-text").textContent = `Distance from the ghost: ${this.ghost?.label}`;
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
    if (this.run.solver) this.showPlots();
    this.resize();
  }

  /** Show the energies, the momenta, and how far every ball is from its ghost. */
  showPlots() {
    const { run, ghost, duration, style } = this;
    const { balls, units, look } = this.content;
    const [energies, momenta, gaps] = this.plots;
    const both = [[run, style.ink], ...(ghost ? [[ghost, style.faint]] : [])].reverse();
    const curves = (valueAt) =>
      both.map(([one, ink]) => curveOf(valueAt, one, duration, ink, style.page));
    energies.show(curves(energyAt), "J", duration, style);
    const momentum = (one, t) => Math.hypot(...momentumAt(one, t));
    momenta.show(curves(momentum), "N s", duration, style);
    byId("energy-text").textContent = run.gyration ? ", with that of rolling:" : ":";
    if (!ghost) return;
    const [name, unit] = units.length;
    const all = distanceCurves(run, ghost, duration, balls, unit);
    gaps.show(all, name, duration, style, look);
    const keyed = this.content.legend.map((i) => all[i]);
    const apart = keyed.filter(({ points }) => points.some(([, gap]) => gap > 0));
    const keys = apart.length ? apart.map(keyOf) : ["(none, to the last digit)"];
    byId("apart-legend").replaceChildren(...keys.slice(0, CROWD));
  }

  listEvents() {
    const { events, duration, message } = this.run;
    const shown = events.slice(0, MOST_EVENTS);
    const unlisted = events.length - shown.length;
    const more = unlisted ? `${unlisted} more events are not listed. ` : "";
    shown.push({ t: duration, says: more + message });
    const decimals = this.run.decimals + 1;
    const last = `${duration.toFixed(decimals)} s`;
    byId("events").style.setProperty("--letters", last.length);
    this.rows = shown.map((event) => {
      const parts = [`${event.t.toFixed(decimals)} s`, event.says ?? this.words(event)];
      const row = button(() => this.jump(event.t), ...parts.map((text) => element("span", text)));
      row.classList.toggle("quiet", !isMarked(event));
      return row;
    });
    this.rows.times = shown.map((event) => event.t);
    byId("events").replaceChildren(...this.rows.map((row) => element("li", row)));
  }

  /** Say in words what happens. */
  words({ kind, balls, side, pocket, patch }) {
    const [a, b] = balls.map((i) => this.names[i]);
    if (kind === "ball-ball") return `${a} meets ${b}`;
    if (kind === "ball-cushion") return `${a} meets ${side}`;
    if (kind === "pocket") return `${a} falls into ${isolated(pocket)}`;
    const where = patch === undefined ? "leaves the patches" : `comes into patch ${patch}`;
    if (kind === "patch") return `${a} ${where}`;
    return `${a} ${kind === "roll" ? "begins to roll" : "stops"}`;
  }

  // -- time -----------------------------------------------------------------------------------

  play() {
    if (this.playing || !this.duration) return;
    if (this.time >= this.duration) this.time = 0;
    this.before = performance.now();
    this.mark(true);
  }

  pause() {
    cancelAnimationFrame(this.frame);
    this.mark(false);
  }

  /** Advance by the time that has passed since the last frame; `now` is in ms. */
  tick(now) {
    const passed = Math.max(now - this.before, 0) / 1000;
    this.before = now;
    this.time = Math.min(this.time + passed * this.speed, this.duration);
    this.mark(this.time < this.duration);
    this.draw();
  }

  /** Stop at a time. */
  jump(t) {
    this.pause();
    this.time = Math.min(Math.max(t, 0), this.duration);
    this.draw();
  }

  /** Go to the last contact or the next; where there is none, to the start or to the end. */
  step(sign) {
    const times = this.run.events.filter(isMarked).map((event) => event.t);
    if (sign > 0) this.jump(times.find((t) => t > this.time) ?? this.duration);
    else this.jump(times.findLast((t) => t < this.time) ?? 0);
  }

  setSpeed(speed = this.speed) {
    this.speed = byId("speed").value = speed;
    this.draw();
  }

  // -- the page -------------------------------------------------------------------------------

  resize() {
    const [bar, plots, table] = ["bar", "plots", "table"].map(byId);
    for (const plot of this.plots) plot.fit();
    // In a narrow window, plots are scrolled to; a frame in another page shows them at once.
    const wide = matchMedia("(min-width: 60rem)").matches || window.parent !== window;
    const last = wide && !plots.hidden && !this.keepsPlot ? plots : bar;
    const kept = wide && this.keepsPlot ? KEPT : 0;
    const others = last.offsetTop + last.offsetHeight - table.offsetHeight + kept + 12;
    this.table.fit(byId("stage").clientWidth, Math.max(window.innerHeight - others, LOWEST));
    this.drawTicks();
    this.draw();
  }

  draw() {
    const { run, ghost, time: t, speed: pace, picked } = this;
    const hits = this.playing ? [] : run.events.filter((event) => event.row && event.t === t);
    const [trails, arrows] = ["trails", "arrows"].map((id) => byId(id).checked);
    this.table.draw({ run, ghost, t, pace, picked, trails, arrows, hits });
    this.plots[0].draw(t);
    this.plots[1].draw(t);
    this.plots[2].draw(t, picked);
    const joules = (one) => `${energyAt(one, t).toPrecision(4)} J`;
    const its = ghost ? ` (ghost: ${joules(ghost)})` : "";
    byId("energy").textContent = run.solver && joules(run) + its;
    const [px, py] = momentumAt(run, t).map((p) => p.toFixed(4));
    byId("momentum").textContent = run.solver && `${px}, ${py} N s along x, y`;
    this.tellContacts(hits);
    byId("time").value = t;
    const decimals = run.decimals + (pace < 0.1 ? 1 : 0);
    byId("clock").textContent = `${t.toFixed(decimals)} s`;
    this.markEvents();
    this.tell();
  }

  /** Ask for the next frame, or stop; the button shows what a click will do. */
  mark(playing) {
    this.playing = playing;
    if (playing) this.frame = requestAnimationFrame((now) => this.tick(now));
    byId("play").textContent = playing ? "\u275A\u275A" : "\u25B6\uFE0E";
    byId("play").ariaLabel = playing ? "Pause" : "Play";
  }

  /** Mark the contacts on the rail of time; the slider's knob is 16 pixels wide. */
  drawTicks() {
    const canvas = byId("ticks");
    const ratio = setSize(canvas, byId("rail").clientWidth, canvas.clientHeight);
    const pen = canvas.getContext("2d");
    for (const event of this.run.events.filter(isMarked)) {
      const top = event.kind === "ball-cushion" ? 0.45 * canvas.height : 0;
      pen.fillStyle = event.pocket ? "#d55e00" : this.style.ink;
      const x = 8 * ratio + (event.t / (this.duration || 1)) * (canvas.width - 16 * ratio);
      pen.fillRect(x - ratio / 2, top, ratio, canvas.height - top);
    }
  }

  /** Mark what has happened in the list, and keep it in sight. */
  markEvents() {
    const count = this.rows.times.filter((t) => t <= this.time).length;
    if (count === this.rows.marked) return;
    this.rows.marked = count;
    this.rows.forEach((row, k) => {
      row.classList.toggle("past", k < count);
      row.toggleAttribute("aria-current", k === count - 1);
    });
    const list = byId("events");
    const row = this.rows[Math.max(count - 1, 0)];
    list.scrollTop = row.offsetTop - list.offsetTop - list.clientHeight / 2;
    this.tellPocketed();
  }

  /** Say which balls are off the table. */
  tellPocketed() {
    const fallen = this.run.events.filter((e) => e.pocket && e.t <= this.time);
    const names = this.run.off.map((i) => this.names[i]);
    names.push(...fallen.map((e) => `${this.names[e.balls[0]]} (${isolated(e.pocket)})`));
    byId("pocketed").hidden = !names.length;
    byId("pocketed").textContent = `Off the table: ${names.join(", ")}`;
  }

  /** Show the rows of the contacts at which the time stands. */
  tellContacts(hits) {
    byId("contact").hidden = !hits.length;
    byId("contact").replaceChildren(...hits.flatMap((event) => this.contactRow(event)));
  }

  /** Return what a contact did: its place and impulses in words, its velocities in a table. */
  contactRow(event) {
    const { row, balls, place } = event;
    const { length, speed } = this.content.units;
    const number = (value) => (value ?? Number.NaN).toPrecision(4);
    const [x, y] = place.map((value) => (value / length[1]).toFixed(3));
    const angle = ((Math.atan2(row.normal[1], row.normal[0]) * 180) / Math.PI).toFixed(2);
    const kind = { stick: "; they part without slip", slip: "; they slip" }[row.kind] ?? "";
    const said = [
      `${this.words(event)} at ${x}, ${y} ${length[0]}; normal ${angle}°${kind}`,
      row.lost !== null && `energy lost: ${number(row.lost)} J`,
    ].filter(Boolean);
    const lines = said.map((text) => element("p", text));
    const along = (axis, value) => ["J", element("sub", axis), ` ${number(value)} N s`];
    const impulses = [...along("n", row.impulse), ", ", ...along("t", row.tangential)];
    if (row.impulses.length) lines.splice(1, 0, element("p", ...impulses));
    const pair = (v) => v.map((value) => (value / speed[1]).toFixed(4)).join(", ");
    const cells = row.before.map((v, n) => [this.names[balls[n]], pair(v), pair(row.after[n])]);
    cells.unshift(["", `before (${speed[0]})`, "after"]);
    const rows = cells.map((line) => element("tr", ...line.map((text) => element("td", text))));
    return [...lines, element("table", ...rows)];
  }

  /** Write the motion and the place of the picked ball beside it. */
  tell() {
    const box = byId("ball");
    box.hidden = this.picked === null;
    if (box.hidden) return;
    const { x, y, vx, vy, wx, wy } = stateAt(this.run, this.picked, this.time);
    const { length, speed } = this.content.units;
    const round = (value, [name, unit]) => `${(value / unit).toFixed(3)} ${name}`;
    const motion = (x, y) => {
      const angle = ((Math.atan2(y, x) * 180) / Math.PI).toFixed(1);
      return `${round(Math.hypot(x, y), speed)} at ${angle}\u00b0`;
    };
    const name = isolated(shortened(this.content.balls[this.picked].id));
    const moves = Math.hypot(vx, vy, wx, wy) ? motion(vx, vy) : "at rest";
    const roll = vx === wx && vy === wy ? "" : `\nslides; its roll: ${motion(wx, wy)}`;
    box.textContent = `${name}: ${moves}${roll}\n${round(x, length)}, ${round(y, length)}`;
    this.table.putBeside(box, x, y);
  }

  /** Pick the ball under the pointer, or the nearest one within this distance (pixels). */
  pick(event, within) {
    if (this.held) return;
    this.picked = this.table.nearest(event, this.run, this.time, within);
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
    for (const id of ["trails", "arrows"]) on(id, "change", () => this.draw());
    on("theme", "click", () => this.dress(!this.dark));
    for (const plot of this.plots) {
      plot.canvas.addEventListener("pointerdown", (event) => this.jump(plot.time(event)));
    }
    on("table", "pointermove", (event) => event.pointerType === "mouse" && this.pick(event, 2));
    on("table", "pointerdown", (event) => this.pick(event, event.pointerType === "mouse" ? 2 : 16));
    on("table", "pointerleave", (event) => event.pointerType === "mouse" && this.pick(event, -1e9));
    document.addEventListener("pointerdown", ({ target }) => {
      this.opened = target.closest("select");
    });
    document.addEventListener("change", ({ target }) => target === this.opened && target.blur());
    document.addEventListener("keydown", (event) => this.key(event));
    window.addEventListener("resize", () => this.resize());
    this.scheme.addEventListener("change", () => this.dress(this.scheme.matches));
  }

  key(event) {
    this.opened = null;
    if (event.target.closest("select, input:not([type=range]):not([type=checkbox])")) return;
    const pressed = event.target.closest("button, input[type=checkbox]");
    const k = Number(event.key) - 1;
    const nudge = NUDGE * Math.min(this.duration, 1) * this.speed;
    const faster = (sign) => this.setSpeed(SPEEDS[SPEEDS.indexOf(this.speed) + sign]);
    obey(event, {
      " ": !pressed && (() => byId("play").click()),
      ArrowLeft: () => this.step(-1),
      ArrowRight: () => this.step(1),
      ",": () => this.jump(this.time - nudge),
      ".": () => this.jump(this.time + nudge),
      Home: () => this.jump(0),
      End: () => this.jump(this.duration),
      "+": () => faster(1),
      "=": () => faster(1),
      "-": () => faster(-1),
      t: () => byId("trails").click(),
      a: () => byId("arrows").click(),
      d: () => byId("theme").click(),
      [k >= 0 && k < this.content.shots.length && event.key]: () => this.choose(k),
    });
  }
}

/** Do what a key does, if anything. */
function obey(event, actions) {
  if (event.ctrlKey || event.metaKey || event.altKey) return;
  const action = actions[event.key] || actions[event.key.toLowerCase()];
  if (!action) return;
  event.preventDefault();
  action();
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

/** Return what a legend says of a curve: a piece of it, and its name. */
function keyOf({ name, color, halo, dashes }) {
  const line = element("i");
  const ends = dashes.map((_, k) => 2 * dashes.slice(0, k + 1).reduce((a, b) => a + b));
  const parts = ends.map(
    (end, k) => `${k % 2 ? "transparent" : color} ${ends[k - 1] ?? 0}px ${end}px`,
  );
  const dashed = `repeating-linear-gradient(90deg, ${parts.join()})`;
  Object.assign(line.style, { background: parts.length ? dashed : color, borderColor: halo });
  return element("span", line, isolated(shortened(name)));
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
