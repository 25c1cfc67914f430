// The film's time: slider, play button, speed and keys.
class Clock {
  constructor(runs, show) {
    this.show = show;
    this.end = Math.max(...runs.map((run) => run.end));
    this.step = Math.min(...runs.map((run) => run.step));
    this.slider = byId('time');
    this.slider.max = Math.ceil(this.end / this.step - 1e-3);
    this.button = byId('play');
    this.time = 0;
    this.playing = false;
    this.listen();
  }

  seek(time) {
    this.time = Math.min(this.end, Math.max(0, time));
    // A step's own time, unless the film plays between two of them.
    this.slider.value = Math.round(this.time / this.step);
    const text = `${this.time.toFixed(2)} s`;
    this.slider.setAttribute('aria-valuetext', text);
    byId('clock').textContent = `${text} of ${this.end.toFixed(2)} s`;
    this.show(this.time);
  }

  move(steps) { this.seek((Math.round(this.time / this.step) + steps) * this.step); }

  play(playing) {
    this.playing = playing;
    make(this.button, {'aria-pressed': playing}, null, playing ? 'Pause' : 'Play');
    if (!playing) return;
    if (this.time >= this.end) this.seek(0);
    let before = null;
    const tick = (now) => {
      if (!this.playing) return;
      const elapsed = before === null ? 0 : (now - before) / 1000;
      before = now;
      this.seek(this.time + elapsed * Number(byId('speed').value));
      if (this.time >= this.end) this.play(false);
      else requestAnimationFrame(tick);
    };
    requestAnimationFrame(tick);
  }

  listen() {
    this.button.addEventListener('click', () => this.play(!this.playing));
    this.slider.addEventListener('input', () => this.seek(this.slider.value * this.step));
    document.addEventListener('keydown', (event) => this.key(event));
  }

  key(event) {
    const slider = event.target === this.slider;
    if (event.ctrlKey || event.altKey || event.metaKey) return;
    // What has the focus keeps the keys that it needs itself.
    if (!slider && event.target.closest('select, summary, [tabindex]')) return;
    if (event.key === ' ' && event.target.closest('button')) return;
    const steps = event.shiftKey ? 10 : 1;
    const actions = {
      ' ': () => this.play(!this.playing),
      ArrowRight: () => this.move(steps),
      ArrowLeft: () => this.move(-steps),
      Home: () => this.seek(0),
      End: () => this.seek(this.end),
    };
    if (!Object.hasOwn(actions, event.key)) return;
    event.preventDefault();
    actions[event.key]();
  }
}
