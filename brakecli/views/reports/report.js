"use strict";
for (const figure of document.querySelectorAll("figure.map")) {
  const data = JSON.parse(figure.querySelector("script").textContent);
  const svg = figure.querySelector("svg[tabindex]"), cursor = figure.querySelector(".cursor");
  const output = figure.querySelector("output"), last = [data.xs.length - 1, data.ys.length - 1];
  let at = null;
  const show = (i, j) => {
    at = [Math.min(Math.max(i, 0), last[0]), Math.min(Math.max(j, 0), last[1])];
    const [left, right] = data.x.slice(at[0], at[0] + 2), ends = data.y.slice(at[1], at[1] + 2);
    const box = { x: left, y: Math.min(...ends), width: right - left, height: Math.abs(ends[0] - ends[1]) };
    for (const [name, value] of Object.entries(box)) cursor.setAttribute(name, value);
    cursor.setAttribute("visibility", "visible");
    const values = [[data.names[0], data.xs[at[0]]], [data.names[1], data.ys[at[1]]]];
    for (const [name, column] of Object.entries(data.columns)) {
      const value = column.values[at[0]][at[1]];
      values.push([name, value === null ? "–" : column.texts ? column.texts[value] : `${value} ${column.unit}`.trim()]);
    }
    output.replaceChildren(...values.filter(([name, value]) => name && value).map(([name, value]) => {
      const item = document.createElement("span"), bold = document.createElement("b");
      bold.textContent = `${name} `;
      item.append(bold, value, " ");
      return item;
    }));
  };
  const cell = (edges, place) => {
    for (let k = 0; k + 1 < edges.length; k++)
      if ((place - edges[k]) * (place - edges[k + 1]) <= 0) return k;
    return null;
  };
  const point = (event) => {
    const place = new DOMPoint(event.clientX, event.clientY).matrixTransform(svg.getScreenCTM().inverse());
    const i = cell(data.x, place.x), j = cell(data.y, place.y);
    if (i !== null && j !== null) show(i, j);
  };
  svg.addEventListener("pointermove", point);
  svg.addEventListener("pointerdown", point);
  svg.addEventListener("focus", () => { if (!at) show(0, 0); });
  svg.addEventListener("keydown", (event) => {
    const [i, j] = at ?? [0, 0];
    const to = { ArrowLeft: [i - 1, j], ArrowRight: [i + 1, j], ArrowUp: [i, j + 1], ArrowDown: [i, j - 1],
      Home: [0, j], End: [last[0], j], PageUp: [i, last[1]], PageDown: [i, 0] }[event.key];
    if (to) { event.preventDefault(); show(...to); }
  });
}
addEventListener("beforeprint", () => {
  for (const each of document.querySelectorAll("details:has(table)")) each.open = true;
});
