// What each figure draws: `column` of the run's data, and which number of its rows.
const perRobot = (run, column, at) =>
  Array.from({length: run.robots}, (_, k) => ({label: `${k + 1}`, robot: k, column, at: at(k), look: look(k)}));

const single = (label, column, at, style) => ({label, robot: null, column, at, look: style});

const FIGURES = [
  {
    title: 'Governed references, x', unit: 'm',
    lines: (run) => [...perRobot(run, 'm', (k) => 2 * k), single('r', 'r', 0, 'asked'), single('m*', 'mstar', 0, 'optimum')],
  },
  {
    title: 'Governed references, y', unit: 'm',
    lines: (run) => [...perRobot(run, 'm', (k) => 2 * k + 1), single('r', 'r', 1, 'asked'), single('m*', 'mstar', 1, 'optimum')],
  },
  {title: 'True margin of hand points', unit: 'm', zero: true, lines: (run) => perRobot(run, 'margin', (k) => k)},
  {
    title: 'Distance from the centralized optimum', unit: 'm', log: 1e-6,
    lines: () => [
      single('farthest robot', 'gap', 0, 'c0 d0'),
      single('farthest leader', 'leader_gap', 0, 'c1 d1'),
      single('spread of references', 'spread', 0, 'c2 d2'),
    ],
  },
  {
    title: 'Largest certificate row (above 0: no certificate)', unit: 'm', zero: true,
    lines: () => [single('largest row', 'certificate', 0, 'c0 d0')],
  },
  {title: 'Storage V', unit: 'm²', log: 1e-8, lines: () => [single('V', 'storage', 0, 'c0 d0')]},
  {
    title: 'Largest multiplier', unit: 'm', zero: true,
    lines: (run) => [...perRobot(run, 'multiplier', (k) => k), single('centralized', 'multiplier_star', 0, 'optimum')],
  },
];
