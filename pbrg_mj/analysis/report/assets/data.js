// Runs as typed arrays.
function unpacked({width, data}) {
  const text = atob(data);
  const bytes = new Uint8Array(text.length);
  for (let i = 0; i < text.length; i++) bytes[i] = text.charCodeAt(i);
  return {width, values: new Float32Array(bytes.buffer)};
}

function opened(film, index) {
  const columns = Object.fromEntries(Object.entries(film.columns).map(([name, column]) => [name, unpacked(column)]));
  const time = columns.time.values;
  return {
    ...film, columns, time,
    number: index + 1,
    frames: time.length,
    end: time[time.length - 1],
    step: time.length > 1 ? time[1] - time[0] : 1,
    sensed: new Sensed(unpacked(film.changes).values),
    at: (name, frame, place) => columns[name].values[frame * columns[name].width + place],
  };
}

// The last frame at or before a time.
function frameAt(run, time) {
  let low = 0;
  let high = run.frames - 1;
  while (low < high) {
    const middle = Math.ceil((low + high) / 2);
    if (run.time[middle] <= time + 0.01 * run.step) low = middle;
    else high = middle - 1;
  }
  return low;
}

// The half-spaces at a frame, kept up from one frame to the next. A row of changes: frame, slot, Gx, Gy, h.
class Sensed {
  constructor(changes) {
    this.changes = changes;
    this.rewind();
  }

  rewind() {
    this.next = 0;
    this.frame = -1;
    this.slots = new Map();
  }

  at(frame) {
    if (frame < this.frame) this.rewind();
    this.frame = frame;
    for (; this.next < this.changes.length && this.changes[this.next] <= frame; this.next += 5) {
      const [, slot, x, y, h] = this.changes.subarray(this.next, this.next + 5);
      if (Number.isNaN(x)) this.slots.delete(slot);
      else this.slots.set(slot, [x, y, h]);
    }
    return this.slots;
  }
}
