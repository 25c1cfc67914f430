// Scales, ticks and numbers as text.
function roundSteps(low, high, wanted) {
  const rough = (high - low) / Math.max(1, wanted);
  const power = 10 ** Math.floor(Math.log10(rough));
  const step = [1, 2, 5, 10].map((k) => k * power).find((size) => size >= rough * 0.999);
  const ticks = [];
  for (let k = Math.ceil(low / step - 1e-9); k * step <= high + 1e-9 * step; k++) ticks.push(k * step);
  return ticks;
}

function powersOfTen(low, high) {
  const first = Math.ceil(Math.log10(low) - 1e-9);
  const last = Math.floor(Math.log10(high) + 1e-9);
  const every = Math.max(1, Math.ceil((last - first) / 4));
  const ticks = [];
  for (let k = first; k <= last; k += every) ticks.push(10 ** k);
  return ticks;
}

// Values from low to high onto pixels from start to end.
function scale(low, high, start, end, log) {
  const f = log ? Math.log10 : (value) => value;
  const rate = (end - start) / (f(high) - f(low));
  const place = (value) => start + (f(log ? Math.max(value, low) : value) - f(low)) * rate;
  place.ticks = (wanted) => (log ? powersOfTen(low, high) : roundSteps(low, high, wanted));
  return place;
}

const MINUS = '−';

function short(value, digits = 4) {
  if (Number.isNaN(value)) return '–';
  const size = Math.abs(value);
  const text = size !== 0 && (size < 1e-3 || size >= 1e5) ? value.toExponential(1).replace('.0e', 'e') : `${+value.toPrecision(digits)}`;
  return text.replaceAll('-', MINUS);
}
