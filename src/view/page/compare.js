// SPDX-License-Identifier: BSD-3-Clause
// A second run beside the first: one clock, one camera, and how far their poses are apart. Bodies
// belong together by their names.
import {element} from './element.js';
import {newState} from './motion.js';
import {Overlays} from './overlays.js';
import {Stage} from './stage.js';

const kMostSamples = 400;
const kLeast = 1e-10;  // a smaller difference is not drawn
const kMostPlaces = 200000;  // bodies times samples

// The angle between two orientations.
function turnBetween(p, q) {
  const cosine = Math.abs(p.reduce((sum, x, k) => sum + x * q[k], 0));
  const sine = Math.min(...[1, -1].map((sign) => Math.hypot(...p.map((x, k) => x - sign * q[k])))) / 2;
  return cosine > 0.9 ? 4 * Math.asin(Math.min(1, sine)) : 2 * Math.acos(Math.min(1, cosine));
}

// Bodies of the same name, [of the first run, of the second]; those that move in either.
export function commonBodies(run, other) {
  const byName = new Map(other.bodies.map((body) => [body.name, body]));
  const same = ({name, number}) => (other.bodies[number]?.name === name ? other.bodies[number] : byName.get(name));
  return run.bodies.map((body) => [body, same(body)])
    .filter(([a, b]) => b && (a.kind !== 'static' || b.kind !== 'static'));
}

// How far the centre of mass of a body is from that in the other run, and by how much it is turned.
export function differenceOf(run, other, [a, b], t) {
  if (!run.isPresent(a, t) || !other.isPresent(b, t)) return undefined;
  const [p, q] = [run.centerOf(a, t), other.centerOf(b, t)];
  const turns = [run.stateInto(a, t, newState()).q, other.stateInto(b, t, newState()).q];
  return {distance: Math.hypot(...p.map((x, k) => x - q[k])), turn: turnBetween(...turns)};
}

// The body that is farthest from where it is in the other run.
export function largestDifference(run, other, pairs, t) {
  let most;
  for (const pair of pairs) {
    const found = differenceOf(run, other, pair, t);
    if (found && !(found.distance <= most?.distance)) most = {...found, body: pair[0]};
  }
  return most;
}

// Columns of time, largest distance and largest turn of all bodies.
export function differenceCurve(run, other) {
  const pairs = commonBodies(run, other);
  const end = Math.min(run.ownEnd, other.ownEnd);
  const count = Math.max(2, Math.min(kMostSamples, 4 * Math.max(run.steps.rows.length, other.steps.rows.length),
                                     Math.floor(kMostPlaces / Math.max(1, pairs.length))));
  const times = Array.from({length: count}, (_, k) => run.begin + ((end - run.begin) * k) / (count - 1));
  const positive = (x) => (x > kLeast ? x : null);
  const all = times.map((t) => pairs.map((pair) => differenceOf(run, other, pair, t)).filter(Boolean));
  const most = (key) => all.map((list) => positive(list.reduce((best, one) => Math.max(best, one[key]), 0)));
  return [times, most('distance'), most('turn')];
}

export class Compare {
  constructor(player, other) {
    this.player = player;
    this.run = other;
    this.pairs = commonBodies(player.run, other);
    document.body.classList.add('two');
    const canvas = element('canvas', {id: 'stage-two', 'aria-label': 'The second run, seen by the same camera'});
    player.stage.canvas.after(canvas);
    this.stage = new Stage(canvas, other, element('div'));
    this.overlays = new Overlays(this.stage);
    this.overlays.show = player.overlays.show;
    // Whichever picture is dragged, both cameras follow.
    this.stage.onChange = () => {
      if (this.isFollowing) return;
      this.#copy(this.stage, player.stage);
      player.stage.isFramed = false;
      player.redraw();
    };
    this.names = [player.run, other].map((run, k) =>
      element('div', {class: 'label run-name', 'data-run': String(k)}, run.source || `run ${k + 1}`));
    document.getElementById('view').append(...this.names);
    this.words = element('div', {class: 'label', id: 'difference', role: 'status'});
    document.getElementById('view').append(this.words);
  }

  #copy(from, to) {
    this.isFollowing = true;
    to.camera.position.copy(from.camera.position);
    to.camera.fov = from.camera.fov;
    to.isCut = from.isCut;
    to.controls.target.copy(from.controls.target);
    to.controls.update();
    this.isFollowing = false;
  }

  setTheme(theme) {
    this.stage.setTheme(theme);
  }

  // Its own frame is for the light and the ground only: the camera is that of the first.
  resize() {
    this.isFollowing = true;
    this.stage.resize();
    this.stage.frame();
    this.stage.isFramed = false;
    this.isFollowing = false;
  }

  draw(t, isStill, numberText) {
    const {player, stage, run} = this;
    this.#copy(player.stage, stage);
    stage.ground.isShown = player.stage.ground.isShown;
    const same = (number) => run.bodies.find(({name}) => name === player.run.bodies[number].name)?.number;
    stage.pair = player.stage.pair?.map((side) => side.map(same));
    player.paint(run, stage);
    stage.place(t);
    const {rows} = run.impacts;
    const now = [];
    for (let k = run.impacts.at(t); k >= 0 && rows[k].t === t; --k) now.push(rows[k]);
    this.overlays.update(t, now, undefined, isStill);
    stage.render(isStill);
    this.largest = largestDifference(player.run, run, this.pairs, t);
    this.words.textContent = !this.largest ? 'no body of the same name'
      : this.largest.distance > 0 ? `${this.largest.body.name} is ${numberText(this.largest.distance)} apart` : 'all poses are the same';
  }
}
