// Elements. Text goes in as text, never as markup.
const SVG = 'http://www.w3.org/2000/svg';

function make(element, attributes, parent, text) {
  for (const [name, value] of Object.entries(attributes)) element.setAttribute(name, value);
  if (text !== undefined) element.textContent = text;
  if (parent) parent.append(element);
  return element;
}

const html = (tag, attributes = {}, parent = null, text = undefined) =>
  make(document.createElement(tag), attributes, parent, text);

const svg = (tag, attributes = {}, parent = null, text = undefined) =>
  make(document.createElementNS(SVG, tag), attributes, parent, text);

// Seven colours, five dashes: 35 robots before a look repeats. Labels tell all of them apart.
const look = (robot) => `c${robot % 7} d${robot % 5}`;

const byId = (id) => document.getElementById(id);
