// SPDX-License-Identifier: BSD-3-Clause
// Time, what is chosen and what is shown; draws when something has changed.
import {Vector3} from 'three';
import {Compare} from './compare.js';
import {Curves, shortNumber} from './curves.js';
import {Measure} from './measure.js';
import {Overlays} from './overlays.js';
import {element} from './element.js';
import {Panel} from './panel.js';
import {bodyColor, heat, Stage} from './stage.js';
import {timeText, Timeline} from './timeline.js';

export const kColorings = ['body', 'speed', 'sleep', 'island'];
const kIslandHues = 12;
const kSlowest = 0.05;   // part of the speed, at an impact in slow motion
const kSlowReach = 0.25;  // seconds of playing before and after an impact that are slowed down
const kStill = 250;  // milliseconds without a new time, after which a picture stands still
const kUntilSaid = 700;  // milliseconds
const kUntilReading = 150;  // milliseconds
const kReading = 'Reading this time';
const kBehind = 0.1;  // seconds behind the end of a live run that keeps to the clock
const kFarBehind = 1;
const kHaste = 0.1;  // part of the speed by which it is caught up with, or waited for
const kFlash = 0.35;  // seconds for which an impact is seen while the run plays

export class Player {
  constructor(run) {
    this.run = run;
    this.t = run.begin;
    this.speed = 1;
    this.isPlaying = false;
    this.loops = false;
    this.coloring = 'body';
    this.chosen = {};
    this.flashes = [];
    const byId = (id) => document.getElementById(id);
    this.stage = new Stage(byId('stage'), run);
    this.overlays = new Overlays(this.stage);
    this.timeline = new Timeline(byId('timeline'), run, (t) => this.seek(t));
    this.curves = new Curves(byId('tab-curves'), run, (t) => this.seek(t), () => this.redraw());
    this.panel = new Panel(run, {
      seek: (t) => this.goTo(t),
      chooseBody: (body) => this.choose({body}),
      chooseImpact: (k) => this.goToImpact(k),
      setHidden: (numbers) => {
        this.hidden = numbers;
        this.#setManners();
        this.notify();
      },
      setColor: (number, color) => {
        this.ownColors.set(number, color);
        this.notify();
      },
      follow: (body) => {
        this.tracks = true;
        this.choose({body});
      },
    });
    this.hidden = new Set();
    this.ownColors = new Map();
    this.measure = new Measure(this.stage, byId('measure'));
    this.label = byId('label');
    this.clock = byId('time');
    this.legend = byId('legend');
    this.stamp = byId('stamp');
    this.spoken = byId('spoken');
    this.busy = byId('busy');
    this.stage.onChange = () => this.redraw();
    this.changed = new Set();
    this.topSpeed = 0;
    requestAnimationFrame((now) => this.#tick(now));
  }

  redraw() {
    this.isDirty = true;
  }

  notify() {
    this.isDirty = true;
    for (const act of this.changed) act();
  }

  // The run has grown.
  grown() {
    if (this.follows && !this.run.keepsTime) this.t = this.run.end;
    this.curves.stale = true;
    this.notify();
  }

  // A run that keeps to the clock is followed shortly behind its end, so that time flows evenly while
  // the run comes in pieces.
  #follow(seconds) {
    const behind = this.run.end - this.t;
    if (behind <= 0) return;
    const isOver = this.isFinished || behind > kFarBehind;
    const rate = behind > kBehind ? 1 + kHaste : 1 - kHaste;
    this.t = isOver ? this.run.end : Math.min(this.run.end, this.t + rate * seconds);
    this.notify();
  }

  seek(t) {
    this.follows = false;
    this.t = Math.min(Math.max(t, this.run.begin), this.run.end);
    this.flashes = [];
    this.notify();
  }

  // A live run that keeps to the clock goes on by itself: then this holds the picture.
  play(plays = !this.isPlaying) {
    if (this.follows && this.run.keepsTime) plays = this.follows = false;
    this.isPlaying = plays;
    if (plays && this.t >= this.run.end && !this.follows) this.t = this.run.begin;
    this.flashes = [];
    this.notify();
  }

  choose(chosen) {
    this.chosen = chosen;
    this.#setManners();
    this.notify();
  }

  setView(view) {
    this.view = this.view === view ? undefined : view;
    this.#setManners();
    this.notify();
  }

  // isolate: only the chosen body; ghost: the others see-through; wireframe: the chosen one, or all.
  #setManners() {
    const {body} = this.chosen;
    for (const one of this.run.bodies) {
      const isChosen = body === undefined || one === body;
      let manner = one.ghost ? 1 : 0;
      if (this.view === 'wireframe' && isChosen) manner = 2;
      if (this.view === 'ghost' && (body === undefined ? one.kind === 'dynamic' : !isChosen)) manner = 1;
      if (this.view === 'isolate' && !isChosen) manner = 3;
      if (this.hidden.has(one.number)) manner = 3;
      this.stage.manner[one.number] = manner;
    }
  }

  // One committed step on or back.
  step(direction) {
    const ends = this.run.steps;
    let k = ends.at(this.t);
    if (direction > 0) k += 1;
    else if (k >= 0 && ends.rows[k].end === this.t) k -= 1;
    this.isPlaying = false;
    this.choose({body: this.chosen.body});
    this.seek(k < 0 ? this.run.begin : ends.rows[Math.min(k, ends.rows.length - 1)]?.end ?? this.t);
  }

  // The next or previous time at which something hits.
  impact(direction) {
    const {rows} = this.run.impacts;
    let k = this.run.impacts.at(this.t);
    if (direction > 0) {
      k += 1;
    } else {
      while (k >= 0 && rows[k].t === this.t) --k;
    }
    if (k >= 0 && k < rows.length) this.goToImpact(k);
  }

  // What is told of an impact does not stay with a time that is not its own.
  goTo(t) {
    this.choose({body: this.chosen.body});
    this.seek(t);
  }

  goToImpact(k) {
    const impact = this.run.impacts.rows[k];
    this.isPlaying = false;
    this.choose({impact, body: this.chosen.body});
    this.seek(impact.t);
  }

  // Impacts to be seen now: those at this very time, and while playing those just passed.
  #impactsNow(now) {
    const {rows} = this.run.impacts;
    if (this.isPlaying) {
      this.flashes = this.flashes.filter(({until}) => until > now);
      return this.flashes.map(({impact}) => impact);
    }
    const found = [];
    for (let k = this.run.impacts.at(this.t); k >= 0 && rows[k].t === this.t; --k) found.push(rows[k]);
    if (this.chosen.impact?.t === this.t) return [this.chosen.impact];
    return found.reverse();
  }

  #advance(seconds, now) {
    const before = this.t;
    if (this.isWaiting) return;
    this.t += seconds * this.speed * this.slowness();
    if (this.t >= this.run.end) {
      if (this.loops) this.t = this.run.begin;
      else if (this.isLive && !this.isFinished) this.t = this.run.end;
      else [this.t, this.isPlaying] = [this.run.end, false];
    }
    const {rows} = this.run.impacts;
    for (let k = this.run.impacts.at(this.t); k >= 0 && rows[k].t > before; --k) {
      this.flashes.push({impact: rows[k], until: now + 1000 * kFlash});
    }
    if (this.chosen.impact) this.chosen = {body: this.chosen.body};
  }

  // With slow motion, time runs slowly around impacts: from shortly before one to shortly after.
  slowness() {
    if (!this.slows) return 1;
    const {rows, keys} = this.run.impacts;
    const k = this.run.impacts.at(this.t);
    const before = k >= 0 ? this.t - keys.values[k] : Infinity;
    const after = k + 1 < rows.length ? rows[k + 1].t - this.t : Infinity;
    const reach = kSlowReach * this.speed;
    const near = Math.min(before, after) / reach;
    return near >= 1 ? 1 : kSlowest + (1 - kSlowest) * near * near;
  }

  #tick(now) {
    requestAnimationFrame((next) => this.#tick(next));
    if (this.isPlaying) {
      this.#advance(Math.min(0.25, (now - this.lastTick) / 1000 || 0), now);
      this.notify();
    } else if (this.follows && this.run.keepsTime) this.#follow((now - this.lastTick) / 1000 || 0);
    this.lastTick = now;
    if (this.isDirty) this.draw(now);
  }

  // Shows another run beside this one.
  compareWith(other) {
    this.compare = new Compare(this, other);
    this.curves.other = other;
    this.run.end = other.end = Math.max(this.run.end, other.end);
    this.compare.setTheme(this.stage.theme);
    this.onResize();
    this.stage.frame();
    this.notify();
  }

  // Whether the time shown has been read. If not, the picture waits, and so does a run that plays.
  #isRead() {
    const parts = [this.run, this.compare?.run].map((run) => run?.lookAt(this.t)).filter(Boolean);
    const reading = parts.length > 0 ? Promise.all(parts) : undefined;
    this.isWaiting = Boolean(reading);
    clearTimeout(this.saysReading);
    if (!reading) {
      if (this.busy.textContent === kReading) this.busy.hidden = true;
      return true;
    }
    this.saysReading = setTimeout(() => {
      this.busy.textContent = kReading;
      this.busy.hidden = false;
    }, kUntilReading);
    reading.then(() => this.redraw());
    return false;
  }

  // Draws time t, once it has been read.
  async show(t) {
    this.seek(t);
    await Promise.all([this.run.lookAt(this.t), this.compare?.run.lookAt(this.t)]);
    this.draw();
  }

  // `isFinal`: at once as when it has stood still for a while.
  draw(now = performance.now(), isFinal = false) {
    if (!this.#isRead()) return;
    this.isDirty = false;
    this.paint(this.run, this.stage);
    this.#track();
    this.stage.place(this.t);
    const impacts = this.#impactsNow(now);
    const isStill = this.#isStill(now) || isFinal;
    this.overlays.update(this.t, impacts, this.chosen.body, isStill);
    this.measure.update(this.t);
    this.stage.select(this.chosen.body, this.t);
    this.stage.render(isStill);
    this.compare?.draw(this.t, isStill, shortNumber);
    this.#showLabel();
    this.measure.write(this.t);
    this.#showLegend();
    this.stamp.textContent = `t = ${timeText(this.t, this.run.end - this.run.begin)}`;
    this.timeline.draw(this.t, !this.isPlaying);
    this.curves.update(this.t);
    this.panel.showData(this.t, this.chosen, this.overlays.shown);
    this.panel.events.show(this.t, this.chosen.impact);
    this.panel.bodies.show(this.t, this.stage.colors, this.chosen);
    const span = this.run.end - this.run.begin;
    this.clock.replaceChildren(timeText(this.t, span));
    const end = document.createElement('small');
    end.textContent = ` of ${timeText(this.run.end, span)}`;
    this.clock.append(end);
    this.frames = (this.frames ?? 0) + 1;
    this.#speak();
  }

  // The time is said once it has stopped.
  #speak() {
    clearTimeout(this.saying);
    if (this.isPlaying) return;
    const text = `t = ${timeText(this.t, this.run.end - this.run.begin)}${this.t >= this.run.end ? ', the end of the run' : ''}`;
    this.saying = setTimeout(() => {
      if (this.spoken.textContent !== text) this.spoken.textContent = text;
    }, kUntilSaid);
  }

  // The picture of a large run, coarse while time or camera move, is drawn again when they stand still.
  #isStill(now) {
    const {camera, controls} = this.stage;
    const view = [this.t, ...camera.position.toArray(), ...controls.target.toArray()].join();
    const isSame = this.drawnView === view;
    this.drawnView = view;
    if (!isSame) this.stillSince = now;
    if (this.stage.isFine || (isSame && now - this.stillSince >= kStill)) return true;
    clearTimeout(this.waits);
    if (!this.isPlaying) this.waits = setTimeout(() => this.redraw(), kStill);
    return false;
  }

  // The camera goes where the chosen body goes.
  #track() {
    const {body} = this.chosen;
    if (!this.tracks || !body) return (this.tracked = undefined);
    const now = this.run.centerOf(body, this.t);
    if (this.tracked?.body === body) {
      this.stage.shift(new Vector3(...now.map((x, k) => x - this.tracked.p[k])));
    }
    this.tracked = {body, p: now};
  }

  // To the witness points of the nearest pair, until its gap is seen.
  closeUp() {
    const reading = this.run.lookAt(this.t);
    if (reading) return void reading.then(() => this.closeUp());
    this.stage.pair = undefined;
    this.draw();  // all bodies, at the time asked for, which may not have been drawn yet
    const {shown} = this.overlays;
    const sides = shown && [shown.a, shown.b].map((number) => this.run.sideOf(number));
    if (Number.isFinite(shown?.pa?.[0])) {
      this.stage.closeUp(shown.pa, shown.pb, shown.upper, sides);
    } else if (Number.isFinite(shown?.pivot?.[0])) {
      this.stage.closeUp(...this.#endsAround(shown), shown.upper, sides);
    }
    this.notify();
  }

  // Where the recording has no witness points of the pair but its pivot only, the gap is looked for
  // along the line between the bodies' centres, where it is between balls.
  #endsAround({a, b, pivot, upper}) {
    const [from, to] = [a, b].map((number) => new Vector3(...this.run.centerOf(this.run.bodies[number], this.t)));
    const half = to.sub(from).setLength(upper / 2);
    return [-1, 1].map((side) => new Vector3(...pivot).addScaledVector(half, side).toArray());
  }

  paint(run, stage) {
    stage.grow();
    const {colors, theme} = stage;
    const islands = this.coloring === 'island' ? run.islandsAt(this.t) : undefined;
    for (const body of run.bodies) {
      const color = bodyColor(body, theme, colors[body.number]);
      if (this.ownColors.has(body.number)) {
        color.set(this.ownColors.get(body.number));
        continue;
      }
      if (body.kind !== 'dynamic') {
        if (this.coloring !== 'speed' || body.kind === 'static') continue;
      }
      if (this.coloring === 'speed') {
        const {v} = run.state(body, this.t);
        const speed = Math.hypot(...v);
        this.topSpeed = Math.max(this.topSpeed, speed);
        heat(this.topSpeed > 0 ? Math.sqrt(speed / this.topSpeed) : 0, color);
      } else if (this.coloring === 'sleep') {
        color.set(run.isAsleep(body, this.t) ? 0x5b6b85 : 0xf2a03c);
      } else if (this.coloring === 'island') {
        color.setHSL((islands[body.number] * 0.618034) % 1, 0.5,
                     0.45 + 0.12 * (islands[body.number] % 2) * (kIslandHues / 12));
      }
    }
  }

  // What the colours and the marks that are seen now mean.
  #showLegend() {
    const colors = {
      body: [],
      speed: [['#2c3f9e', 'still'], ['#fdd835', `speed ${this.topSpeed.toPrecision(3)}`]],
      sleep: [['#f2a03c', 'awake'], ['#5b6b85', 'asleep']],
      island: [[undefined, 'a colour for each island of bodies in contact']],
    }[this.coloring];
    const states = this.hidesLegend ? [] : this.run.stateNames.map((text) => [this.run.stateColor({text}), text]);
    const entries = [...colors, ...states, ...(this.hidesLegend ? [] : this.overlays.legend())];
    const key = JSON.stringify(entries);
    if (this.legendKey === key) return;
    this.legendKey = key;
    this.legend.replaceChildren(...entries.map(([color, words, sign]) => {
      const entry = element('span', {});
      const mark = element('i', {class: sign ?? 'patch'});
      mark.style.color = color ?? 'transparent';
      entry.append(...(color ? [mark] : []), words);
      return entry;
    }));
  }

  // The gap beside the pivot of the nearest pair.
  #showLabel() {
    const {shown} = this.overlays;
    const place = shown && Number.isFinite(shown.pivot?.[0]) && this.stage.project(shown.pivot);
    const {clientWidth, clientHeight} = this.stage.canvas;
    this.label.hidden = !place?.visible || place.x < 0 || place.x > clientWidth || place.y < 0 || place.y > clientHeight;
    if (this.label.hidden) return;
    this.label.textContent = Number.isFinite(shown.upper)
      ? `gap ${shortNumber(shown.upper)}, proven ${shortNumber(shown.lower)}`
      : `gap at least ${shortNumber(shown.lower)}`;
    const left = Math.max(4, Math.min(place.x + 12, clientWidth - this.label.offsetWidth - 8));
    this.label.style.left = `${left}px`;
    this.label.style.top = `${Math.max(28, place.y - 12 - this.label.offsetHeight)}px`;
  }
}
