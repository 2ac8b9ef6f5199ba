// SPDX-License-Identifier: BSD-3-Clause
// The distance of two points that a user picks; each stays with its body.
import {turned} from './motion.js';
import {shortNumber} from './curves.js';
import {Balls, Lines} from './marks.js';

const kColor = 0xb45309;
const kBallSize = 4e-3;  // of the camera's distance

const minus = (a, b) => a.map((x, k) => x - b[k]);

export class Measure {
  constructor(stage, label) {
    this.stage = stage;
    this.label = label;
    this.ends = [];
    this.isOn = false;
    this.line = new Lines(stage.scene, kColor);
    this.balls = new Balls(stage.scene, kColor);
  }

  toggle() {
    this.isOn = !this.isOn;
    this.ends = [];
  }

  // Points are kept in the frames of their bodies.
  add(hit, t) {
    if (!hit) return;
    if (this.ends.length === 2) this.ends = [];
    const {p, q} = this.stage.run.state(hit.body, t);
    this.ends.push({body: hit.body, point: turned([-q[0], -q[1], -q[2], q[3]], minus(hit.point, p))});
  }

  // The two points in the world at time t, as far as they are picked.
  places(t) {
    return this.ends.map(({body, point}) => {
      const {p, q} = this.stage.run.state(body, t);
      return turned(q, point).map((x, k) => x + p[k]);
    });
  }

  distance(t) {
    const [a, b] = this.places(t);
    return b && Math.hypot(...minus(b, a));
  }

  update(t) {
    const places = this.isOn ? this.places(t) : [];
    this.line.clear();
    this.balls.clear();
    for (const place of places) this.balls.add(place);
    if (places.length === 2) this.line.segment(...places);
    this.line.commit(this.stage.origin);
    this.balls.commit(kBallSize * this.stage.distance, this.stage.origin);
  }

  // After the picture is drawn: words beside the line, or what to do.
  write(t) {
    this.label.hidden = !this.isOn;
    if (!this.isOn) return;
    const [a, b] = this.places(t);
    const names = this.ends.map(({body}) => body.name);
    this.label.textContent = b ? `${shortNumber(this.distance(t), 5)} from ${names[0]} to ${names[1]}`
      : a ? `from ${names[0]}: click the second point` : 'Measure: click two points (u ends)';
    const place = a ? this.stage.project(b ? a.map((x, k) => (x + b[k]) / 2) : a) : {x: 20, y: 90, visible: true};
    const {clientWidth, clientHeight} = this.stage.canvas;
    this.label.style.left = `${Math.min(Math.max(place.x + 10, 4), clientWidth - this.label.offsetWidth - 6)}px`;
    this.label.style.top = `${Math.min(Math.max(place.y + 8, 60), clientHeight - 90)}px`;
  }
}
