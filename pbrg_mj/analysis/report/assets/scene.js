// One run, seen from above.
const TALLEST = 520;
const SHAPES = {
  m: 'M0-5.5L5.5 0L0 5.5L-5.5 0Z',
  mstar: 'M-6-6L6 6M6-6L-6 6',
  r: 'M0-8L1.9-2.6L7.6-2.5L3.1 1L4.7 6.5L0 3.2L-4.7 6.5L-3.1 1L-7.6-2.5L-1.9-2.6Z',
  target: 'M-5 0H5M0-5V5',
};
const REACH = 0.45; // of the emphasised part of a half-space to each side of its robot [m]

class Scene {
  constructor(run, host) {
    this.run = run;
    const title = `Robots of run ${run.number} seen from above`;
    this.root = svg('svg', {class: 'scene', role: 'img', 'aria-label': title}, host);
  }

  layout(width) {
    const [x0, y0, x1, y1] = this.run.extent;
    this.scale = Math.min(width / (x1 - x0), TALLEST / (y1 - y0));
    this.width = width;
    this.height = Math.round((y1 - y0) * this.scale);
    this.left = (x0 + x1) / 2 - width / 2 / this.scale;
    this.top = y1;
    this.root.replaceChildren();
    make(this.root, {width, height: this.height, viewBox: `0 0 ${width} ${this.height}`});
    this.grid();
    this.floor();
    this.layers();
  }

  x(value) { return (value - this.left) * this.scale; }
  y(value) { return (this.top - value) * this.scale; }
  point(x, y) { return `${this.x(x).toFixed(2)} ${this.y(y).toFixed(2)}`; }
  polygon(corners) { return `M${corners.map(([x, y]) => this.point(x, y)).join('L')}Z`; }

  grid() {
    const group = svg('g', {class: 'grid-lines'}, this.root);
    const wanted = Math.max(2, this.width / 110);
    const right = this.left + this.width / this.scale;
    const step = roundSteps(this.left, right, wanted);
    for (const x of step) {
      svg('line', {x1: this.x(x), x2: this.x(x), y1: 0, y2: this.height, 'data-x': x}, group);
      svg('text', {x: this.x(x) + 3, y: this.height - 4}, group, `x = ${short(x)} m`);
    }
    const size = step.length > 1 ? step[1] - step[0] : 1;
    for (const y of roundSteps(this.top - this.height / this.scale, this.top, this.height / this.scale / size)) {
      svg('line', {x1: 0, x2: this.width, y1: this.y(y), y2: this.y(y), 'data-y': y}, group);
      svg('text', {x: 3, y: this.y(y) - 3}, group, `y = ${short(y)} m`);
    }
  }

  floor() {
    for (const {kind, corners} of this.run.still) svg('path', {class: kind, d: this.polygon(corners)}, this.root);
    this.movers = this.run.moverSizes.map(() => svg('path', {class: 'mover'}, this.root));
    for (const [gx, gy, h] of this.run.lines) {
      svg('path', {class: 'line', d: this.along(gx, gy, gx * h, gy * h, this.span())}, this.root);
    }
  }

  span() { return 2 * (this.width + this.height) / this.scale + Math.abs(this.left) + Math.abs(this.top); }

  // A segment of the line with normal (gx, gy) through (x, y), to `reach` metres on each side.
  along(gx, gy, x, y, reach) {
    return `M${this.point(x + gy * reach, y - gx * reach)}L${this.point(x - gy * reach, y + gx * reach)}`;
  }

  layers() {
    const {robots} = this.run;
    const every = Array.from({length: robots}, (_, k) => k);
    this.trails = every.map((k) => this.trail(k));
    this.sensed = new Map();
    this.sensedLayer = svg('g', {}, this.root);
    this.target = this.mark('target');
    if (this.run.target) this.place(this.target, ...this.run.target);
    this.mstar = this.mark('mstar');
    this.r = this.mark('r');
    this.m = every.map((k) => make(this.mark('m'), {class: `m ${look(k)}`, 'data-robot': k + 1}));
    this.robots = every.map((k) => this.robot(k));
  }

  mark(name) { return svg('path', {class: name, d: SHAPES[name], visibility: 'hidden'}, this.root); }

  place(element, x, y) {
    const shown = Number.isFinite(x) && Number.isFinite(y);
    element.setAttribute('visibility', shown ? 'visible' : 'hidden');
    if (shown) element.setAttribute('transform', `translate(${this.x(x).toFixed(2)} ${this.y(y).toFixed(2)})`);
  }

  robot(k) {
    const group = svg('g', {class: `robot ${look(k)}`, 'data-robot': k + 1}, this.root);
    const size = Math.max(4.5, this.run.radius * this.scale);
    const body = svg('circle', {class: 'body', r: size}, group);
    const heading = svg('line', {class: 'heading'}, group);
    const hand = svg('circle', {class: 'dot', r: Math.max(1.8, 0.22 * size)}, group);
    const leader = this.run.leaders.includes(k + 1);
    svg('text', {class: 'label', x: size + 2, y: size + 11}, group, leader ? `${k + 1} (leads)` : `${k + 1}`);
    return {group, body, heading, hand};
  }

  // The whole trajectory faintly, and the part until now as a dash of that length.
  trail(k) {
    const lengths = new Float64Array(this.run.frames);
    const parts = [];
    let [px, py, length] = [NaN, NaN, 0];
    for (let f = 0; f < this.run.frames; f++) {
      const [x, y] = [this.x(this.run.at('hand', f, 2 * k)), this.y(this.run.at('hand', f, 2 * k + 1))];
      if (Math.abs(x) < 1e5 && Math.abs(y) < 1e5) {
        const moved = Math.hypot(x - px, y - py);
        if (Number.isNaN(moved) || moved > 0.3) {
          parts.push(`${parts.length ? 'L' : 'M'}${x.toFixed(1)} ${y.toFixed(1)}`);
          length += moved || 0;
          [px, py] = [x, y];
        }
      }
      lengths[f] = length;
    }
    const common = {d: parts.join(''), 'data-robot': k + 1};
    svg('path', {...common, class: `path ${look(k)}`}, this.root);
    return {path: svg('path', {...common, class: `trail ${look(k)}`}, this.root), lengths};
  }

  show(frame) {
    const {run} = this;
    for (let k = 0; k < run.robots; k++) {
      this.showRobot(k, frame);
      this.place(this.m[k], run.at('m', frame, 2 * k), run.at('m', frame, 2 * k + 1));
      const {path, lengths} = this.trails[k];
      path.setAttribute('stroke-dasharray', `${lengths[frame].toFixed(1)} 1000000`);
    }
    this.place(this.r, run.at('r', frame, 0), run.at('r', frame, 1));
    this.place(this.mstar, run.at('mstar', frame, 0), run.at('mstar', frame, 1));
    this.movers.forEach((mover, b) => this.showMover(mover, b, frame));
    this.showSensed(frame);
  }

  showRobot(k, frame) {
    const [x, y] = [this.run.at('pose', frame, 3 * k), this.run.at('pose', frame, 3 * k + 1)];
    const {group, heading, hand} = this.robots[k];
    this.place(group, x, y);
    const dx = (this.run.at('hand', frame, 2 * k) - x) * this.scale;
    const dy = (y - this.run.at('hand', frame, 2 * k + 1)) * this.scale;
    if (!Number.isFinite(dx + dy)) return;
    make(heading, {x2: dx.toFixed(2), y2: dy.toFixed(2)});
    make(hand, {cx: dx.toFixed(2), cy: dy.toFixed(2)});
  }

  showMover(mover, box, frame) {
    const [x, y] = [this.run.at('movers', frame, 2 * box), this.run.at('movers', frame, 2 * box + 1)];
    const [a, b] = this.run.moverSizes[box].map((size) => size / 2);
    mover.setAttribute('d', this.polygon([[x - a, y - b], [x + a, y - b], [x + a, y + b], [x - a, y + b]]));
  }

  showSensed(frame) {
    const slots = this.run.sensed.at(frame);
    for (const [slot, drawn] of this.sensed) {
      if (!slots.has(slot)) drawn.group.setAttribute('visibility', 'hidden');
    }
    for (const [slot, [gx, gy, h]] of slots) this.showHalfSpace(slot, gx, gy, h, frame);
  }

  // The whole line faintly; boldly, and hatched on its far side, where it is nearest to its robot.
  showHalfSpace(slot, gx, gy, h, frame) {
    const k = Math.floor(slot / this.run.slots);
    const [qx, qy] = [this.run.at('hand', frame, 2 * k), this.run.at('hand', frame, 2 * k + 1)];
    const away = h - gx * qx - gy * qy;
    const [fx, fy] = [qx + away * gx, qy + away * gy];
    if (!Number.isFinite(fx + fy)) return;
    const drawn = this.sensed.get(slot) ?? this.halfSpace(slot, k);
    drawn.group.setAttribute('visibility', 'inherit');
    drawn.whole.setAttribute('d', this.along(gx, gy, fx, fy, this.span()));
    drawn.near.setAttribute('d', this.along(gx, gy, fx, fy, REACH));
    const strokes = [];
    for (let s = -REACH; s <= REACH + 1e-9; s += REACH / 4) {
      const [x, y] = [fx - gy * s, fy + gx * s];
      const out = 7 / this.scale;
      strokes.push(`M${this.point(x, y)}L${this.point(x + out * (gx - 0.6 * gy), y + out * (gy + 0.6 * gx))}`);
    }
    drawn.hatch.setAttribute('d', strokes.join(''));
  }

  halfSpace(slot, k) {
    const group = svg('g', {class: 'half-space', 'data-robot': k + 1}, this.sensedLayer);
    const [whole, near, hatch] = ['whole', 'sensed', 'hatch'].map((kind) => svg('path', {class: `${kind} c${k % 7}`}, group));
    const drawn = {group, whole, near, hatch};
    this.sensed.set(slot, drawn);
    choose.apply(group);
    return drawn;
  }
}
