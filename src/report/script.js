// Sorts a table by the column of a clicked heading.
for (const table of document.querySelectorAll("table.sortable")) {
  const heads = [...table.tHead.rows[0].cells];
  heads.forEach((head, column) => {
    const button = document.createElement("button");
    button.append(...head.childNodes);
    head.append(button);
    button.onclick = () => {
      const down = head.ariaSort === "ascending";
      heads.forEach((other) => other.removeAttribute("aria-sort"));
      head.ariaSort = down ? "descending" : "ascending";
      const key = (row) => row.cells[column].dataset.value ?? row.cells[column].textContent;
      const body = table.tBodies[0];
      const rows = [...body.rows].sort((a, b) => {
        const [one, two] = [key(a), key(b)];
        // Missing values come last either way.
        if (one === "" || two === "") return (one === "") - (two === "");
        const order = isNaN(one) || isNaN(two) ? one.localeCompare(two) : one - two;
        return down ? -order : order;
      });
      body.append(...rows);
    };
  });
}
// Shows the values of all curves below the pointer.
for (const chart of document.querySelectorAll("figure.chart")) {
  const [x0, x1] = chart.dataset.x.split(" ").map(Number);
  const [y0, y1] = chart.dataset.y.split(" ").map(Number);
  const plot = chart.querySelector(".plot");
  const readout = chart.querySelector(".readout");
  const curves = [...chart.querySelectorAll("polyline")].map((line) => ({
    name: line.dataset.name,
    colour: line.getAttribute("class"),
    points: line.getAttribute("points").split(" ").map((point) => point.split(",").map(Number)),
  }));
  // Half the narrowest spacing of a curve: points closer than that are of the same step.
  const gaps = curves.flatMap(({ points }) => points.slice(1).map((point, index) => point[0] - points[index][0]));
  const reach = Math.min(2, ...gaps.filter((gap) => gap > 0).map((gap) => gap / 2));
  const digits = Math.min(8, Math.max(0, Math.ceil(3 - Math.log10(Math.max(y1 - y0, 1e-9)))));
  const show = (event) => {
    const box = plot.getBoundingClientRect();
    const at = (1000 * (event.clientX - box.left)) / box.width;
    const nearestTo = (x, points) => points.reduce((a, b) => (Math.abs(b[0] - x) < Math.abs(a[0] - x) ? b : a));
    const step = nearestTo(at, curves.flatMap((curve) => curve.points))[0];
    // A curve without a point at this step has no value to show.
    const rows = curves.flatMap((curve) => {
      const nearest = nearestTo(step, curve.points);
      if (Math.abs(nearest[0] - step) > reach) return [];
      const row = document.createElement("div");
      const swatch = document.createElement("i");
      swatch.className = curve.colour;
      const value = (y0 + (1 - nearest[1] / 1000) * (y1 - y0)).toFixed(digits);
      row.append(swatch, curves.length > 1 ? `${curve.name} ${value}` : value);
      return row;
    });
    const title = document.createElement("div");
    title.textContent = `step ${Math.round(x0 + (step / 1000) * (x1 - x0))}`;
    readout.replaceChildren(title, ...rows);
    readout.hidden = false;
    readout.style.left = `${step / 10}%`;
    readout.classList.toggle("left", step > 600);
    plot.style.setProperty("--at", `${step / 10}%`);
    plot.classList.add("pointed");
  };
  plot.addEventListener("pointermove", show);
  plot.addEventListener("pointerdown", show);
  plot.addEventListener("pointerleave", () => {
    readout.hidden = true;
    plot.classList.remove("pointed");
  });
}
// Lays one picture of a view over the first, with a slider between them.
for (const view of document.querySelectorAll("figure.view")) {
  const panels = [...view.querySelectorAll(".panel")];
  if (panels.length < 2) continue;
  const bar = document.createElement("div");
  bar.className = "bar";
  const slider = document.createElement("input");
  slider.type = "range";
  slider.max = 1000;
  slider.value = 500;
  slider.setAttribute("aria-label", "share of the first picture");
  slider.oninput = () => view.style.setProperty("--cut", `${slider.value / 10}%`);
  const pick = (over) => {
    view.classList.toggle("stacked", over !== null);
    slider.hidden = over === null;
    panels.forEach((panel, index) => {
      panel.classList.toggle("under", index === 0);
      panel.classList.toggle("over", panel === over);
    });
    buttons.forEach(([button, panel]) => button.setAttribute("aria-pressed", panel === over));
    slider.oninput();
  };
  const button = (text, panel) => {
    const made = document.createElement("button");
    made.textContent = text;
    made.onclick = () => pick(panel);
    bar.append(made);
    return [made, panel];
  };
  const buttons = [button("side by side", null)];
  panels.slice(1).forEach((panel) => buttons.push(button(`${panels[0].dataset.name} | ${panel.dataset.name}`, panel)));
  view.querySelector(".panels").before(bar);
  view.querySelector(".panels").after(slider);
  pick(null);
}
