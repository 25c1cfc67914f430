// One figure of one run over time.
const CHART = {height: 170, left: 50, right: 8, top: 8, bottom: 24};
const CLICK = 6; // pixels that a click may slip
const READ = 9; // most values read out at once

class Chart {
  constructor(run, figure, host, act) {
    Object.assign(this, {run, figure, act, lines: figure.lines(run)});
    this.box = html('div', {class: 'chart'}, host);
    const title = `${figure.title} [${figure.unit}], run ${run.number}, over time`;
    this.root = svg('svg', {role: 'img', 'aria-label': title}, this.box);
    this.readout = html('p', {class: 'readout'}, this.box);
    this.values = this.lines.map((line) => this.entry(line));
    this.hint = html('span', {class: 'hint'}, this.readout, 'choose a robot above to read its values');
    this.listen();
  }

  entry(line) {
    const entry = html('span', line.robot === null ? {} : {'data-robot': line.robot + 1}, this.readout);
    const key = svg('svg', {viewBox: '0 0 22 8', class: 'key', 'aria-hidden': 'true'}, entry);
    svg('path', {class: `curve ${line.look}`, d: 'M0 4H22'}, key);
    entry.append(` ${line.label} `);
    return {entry, value: html('b', {}, entry), line};
  }

  frames([start, end]) { return [Math.max(0, frameAt(this.run, start)), frameAt(this.run, end)]; }

  // Least and largest finite value within a span of time.
  reach(span) {
    let [low, high] = [Infinity, -Infinity];
    const [first, last] = this.frames(span);
    for (const {column, at} of this.lines) {
      for (let f = first; f <= last; f++) {
        const value = this.run.at(column, f, at);
        if (value < low) low = value;
        if (value > high) high = value;
      }
    }
    return [low, high];
  }

  layout(width, span, [low, high]) {
    const {height, left, right, top, bottom} = CHART;
    this.span = span;
    this.x = scale(span[0], span[1], left, width - right);
    this.y = scale(low, high, height - bottom, top, this.figure.log);
    this.root.replaceChildren();
    make(this.root, {width, height, viewBox: `0 0 ${width} ${height}`});
    this.axes(width, low, high);
    const clip = svg('svg', {x: left, y: 0, width: Math.max(0, width - left - right), height: height - bottom + 2}, this.root);
    const shifted = svg('g', {transform: `translate(${-left} 0)`}, clip);
    for (const line of this.lines) this.curve(line, shifted);
    this.cursor = svg('line', {class: 'cursor', y1: top, y2: height - bottom}, shifted);
    this.band = svg('rect', {class: 'band', y: top, height: height - bottom - top, visibility: 'hidden'}, shifted);
  }

  axes(width, low, high) {
    const {height, left, right, top, bottom} = CHART;
    const group = svg('g', {class: 'grid-lines'}, this.root);
    for (const value of this.y.ticks(4)) {
      const y = this.y(value);
      const zero = this.figure.zero && Math.abs(value) < 1e-9 * (high - low);
      svg('line', {x1: left, x2: width - right, y1: y, y2: y, class: zero ? 'zero' : ''}, group);
      svg('text', {x: left - 5, y: y + 4, 'text-anchor': 'end'}, group, short(value));
    }
    for (const value of this.x.ticks((width - left) / 70)) {
      const x = this.x(value);
      svg('line', {x1: x, x2: x, y1: top, y2: height - bottom}, group);
      const anchor = x > width - 24 ? 'end' : 'middle';
      svg('text', {x: anchor === 'end' ? width : x, y: height - 8, 'text-anchor': anchor}, group, `${short(value)} s`);
    }
  }

  // Points that fall onto the one before are left out; whatever moves by half a pixel is kept.
  curve({column, at, look: style, robot}, parent) {
    const [first, last] = this.frames(this.span);
    const parts = [];
    let [px, py, pen] = [-9, -9, 'M'];
    for (let f = first; f <= Math.min(last + 1, this.run.frames - 1); f++) {
      const value = this.run.at(column, f, at);
      if (Number.isNaN(value)) {
        pen = 'M';
        continue;
      }
      const [x, y] = [this.x(this.run.time[f]), this.y(value)];
      if (pen === 'L' && f < last && x - px < 1 && Math.abs(y - py) < 0.5) continue;
      parts.push(`${pen}${x.toFixed(1)} ${Math.max(-1e4, Math.min(1e4, y)).toFixed(1)}`);
      [px, py, pen] = [x, y, 'L'];
    }
    const mine = robot === null ? {} : {'data-robot': robot + 1};
    svg('path', {class: `curve ${style}`, d: parts.join(''), ...mine}, parent);
  }

  show(time, frame) {
    const x = this.x(Math.min(time, this.run.end));
    this.cursor.setAttribute('transform', `translate(${x.toFixed(1)} 0)`);
    const few = this.values.length <= READ;
    this.hint.hidden = few || choose.robot !== null;
    for (const {entry, value, line} of this.values) {
      entry.hidden = !few && line.robot !== null && line.robot + 1 !== choose.robot;
      if (!entry.hidden) value.textContent = short(this.run.at(line.column, frame, line.at));
    }
  }

  time(event) {
    const place = event.clientX - this.root.getBoundingClientRect().left;
    const [start, end] = [this.x(this.span[0]), this.x(this.span[1])];
    const share = Math.min(1, Math.max(0, (place - start) / (end - start)));
    return this.span[0] + share * (this.span[1] - this.span[0]);
  }

  listen() {
    let from = null;
    this.root.addEventListener('pointerdown', (event) => {
      from = {at: event.clientX, time: this.time(event)};
      this.root.setPointerCapture(event.pointerId);
    });
    this.root.addEventListener('pointermove', (event) => {
      if (!from || Math.abs(event.clientX - from.at) < CLICK) return;
      const [a, b] = [this.x(from.time), this.x(this.time(event))].sort((p, q) => p - q);
      make(this.band, {x: a, width: b - a, visibility: 'visible'});
    });
    this.root.addEventListener('pointercancel', () => {
      from = null;
      this.band.setAttribute('visibility', 'hidden');
    });
    this.root.addEventListener('pointerup', (event) => {
      if (!from) return;
      const [a, b] = [from.time, this.time(event)].sort((p, q) => p - q);
      if (Math.abs(event.clientX - from.at) < CLICK) this.act.seek(this.time(event));
      else this.act.zoom([a, b]);
      this.band.setAttribute('visibility', 'hidden');
      from = null;
    });
    this.root.addEventListener('dblclick', () => this.act.zoom(null));
  }
}
