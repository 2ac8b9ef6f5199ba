// SPDX-License-Identifier: BSD-3-Clause
// A long list that has rows only where it is looked at.
import {element} from './element.js';

const kRow = 26;    // pixels: the height of one row, as in style.css
const kSpare = 8;   // rows above and below what is seen

export class VirtualList {
  // `rowOf(item, place)` makes the node of one row.
  constructor(label, rowOf, attributes = {}) {
    this.rowOf = rowOf;
    this.items = [];
    this.tall = element('div', {class: 'tall', role: 'presentation'});
    this.node = element('div', {class: 'rows', tabindex: '0', 'aria-label': label, onscroll: () => this.draw(), ...attributes}, this.tall);
    new ResizeObserver(() => this.draw()).observe(this.node);
  }

  set(items) {
    this.items = items;
    this.tall.style.height = `${kRow * items.length}px`;
    this.draw();
  }

  // Scrolls until a row is in sight, if it is not.
  reveal(place) {
    const {scrollTop, clientHeight} = this.node;
    const top = Math.max(0, place) * kRow;
    if (top < scrollTop || top + kRow > scrollTop + clientHeight) this.node.scrollTop = top - clientHeight / 2;
  }

  draw() {
    const {scrollTop, clientHeight} = this.node;
    const first = Math.max(0, Math.floor(scrollTop / kRow) - kSpare);
    const last = Math.min(this.items.length, Math.ceil((scrollTop + clientHeight) / kRow) + kSpare);
    [this.first, this.last] = [first, last];
    this.tall.replaceChildren(...this.items.slice(first, last).map((item, k) => {
      const row = this.rowOf(item, first + k);
      row.style.top = `${(first + k) * kRow}px`;
      return row;
    }));
  }

  isDrawn(place) {
    return place >= this.first && place < this.last;
  }
}
