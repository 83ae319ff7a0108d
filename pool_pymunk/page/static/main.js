/* The start of the page, and what it offers to other code: window.pool. */

const content = JSON.parse(byId("content").textContent);
const player = new (content.asks ? AskingPlayer : Player)(content);

function finite(call, t) {
  if (!Number.isFinite(t)) throw new RangeError(`${call}(${t}): the time must be a finite number`);
}

window.pool = {
  /** How long the run lasts (s). */
  get duration() {
    return player.run.duration;
  },
  /** The time that is shown (s). */
  get time() {
    return player.time;
  },
  get playing() {
    return player.playing;
  },
  /** Where every ball of the shot is at the time t (s): {id: [x, y]}, in m. */
  positions(t) {
    finite("positions", t);
    const places = statesAt(player.run, t).map(({ x, y }) => [x, y]);
    return Object.fromEntries(player.content.balls.map(({ id }, i) => [id, places[i]]));
  },
  seek(t) {
    finite("seek", t);
    player.jump(t);
  },
  play: () => player.play(),
  pause: () => player.pause(),
  /** Show a shot by its number, from 1. */
  shot(k) {
    const count = player.content.shots.length;
    if (!Number.isInteger(k) || k < 1 || k > count) {
      throw new RangeError(`shot(${k}): the shots have the numbers 1 to ${count}`);
    }
    player.choose(k - 1);
  },
};
