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
// Shows the values of all curves at the step below the pointer.
for (const chart of document.querySelectorAll("figure.chart")) {
  const plot = chart.querySelector(".plot");
  const readout = chart.querySelector(".readout");
  const curves = [...chart.querySelectorAll("polyline")].map((line) => ({
    name: line.dataset.name,
    colour: line.getAttribute("class"),
    values: new Map(line.dataset.values.split(" ").map((pair) => pair.split(":"))),
  }));
  // The steps of all curves, with their places: 0 to 1000.
  const places = new Map();
  for (const line of chart.querySelectorAll("polyline")) {
    const points = line.getAttribute("points").split(" ");
    line.dataset.values.split(" ").forEach((pair, index) => places.set(pair.split(":")[0], Number(points[index].split(",")[0])));
  }
  const show = (event) => {
    const box = plot.getBoundingClientRect();
    const at = (1000 * (event.clientX - box.left)) / box.width;
    const [step, place] = [...places].reduce((a, b) => (Math.abs(b[1] - at) < Math.abs(a[1] - at) ? b : a));
    // A curve without a point at this step has no value to show.
    const rows = curves.filter(({ values }) => values.has(step)).map(({ name, colour, values }) => {
      const row = document.createElement("div");
      const swatch = document.createElement("i");
      swatch.className = colour;
      row.append(swatch, curves.length > 1 ? `${name} ${values.get(step)}` : values.get(step));
      return row;
    });
    const title = document.createElement("div");
    title.textContent = `step ${Number(step).toLocaleString("en")}`;
    readout.replaceChildren(title, ...rows);
    readout.hidden = false;
    readout.style.left = `${place / 10}%`;
    readout.classList.toggle("left", place > 600);
    plot.style.setProperty("--at", `${place / 10}%`);
    plot.classList.add("pointed");
  };
  plot.addEventListener("pointermove", show);
  plot.addEventListener("pointerdown", show);
  plot.addEventListener("pointerleave", () => {
    readout.hidden = true;
    plot.classList.remove("pointed");
  });
}
// Lays one image of a view over the first; the border between them follows the pointer or the arrow keys.
for (const view of document.querySelectorAll("figure.view")) {
  const stage = view.querySelector(".panels");
  const panels = [...stage.querySelectorAll(".panel")];
  if (panels.length < 2) continue;
  const bar = document.createElement("div");
  bar.className = "bar";
  const grip = document.createElement("div");
  grip.className = "grip";
  let cut = 50;
  const move = (to) => {
    cut = Math.max(0, Math.min(100, to));
    view.style.setProperty("--cut", `${cut}%`);
    stage.setAttribute("aria-valuenow", Math.round(cut));
  };
  const isStacked = () => view.classList.contains("stacked");
  const drag = (event) => {
    if (!isStacked() || (event.pointerType === "touch" && event.buttons === 0)) return;
    const box = stage.getBoundingClientRect();
    move((100 * (event.clientX - box.left)) / box.width);
  };
  stage.addEventListener("pointermove", drag);
  stage.addEventListener("pointerdown", drag);
  stage.addEventListener("keydown", (event) => {
    const by = { ArrowLeft: -2, ArrowRight: 2 }[event.key];
    if (!isStacked() || !by) return;
    event.preventDefault();
    move(cut + by);
  });
  const pick = (over) => {
    view.classList.toggle("stacked", over !== null);
    panels.forEach((panel, index) => {
      panel.classList.toggle("under", index === 0);
      panel.classList.toggle("over", panel === over);
    });
    buttons.forEach(([button, panel]) => button.setAttribute("aria-pressed", panel === over));
    for (const [name, value] of Object.entries({ tabindex: 0, role: "slider", "aria-label": "share of the first picture" })) {
      if (over) stage.setAttribute(name, value);
      else stage.removeAttribute(name);
    }
    grip.remove();
    if (over) stage.append(grip);
    move(cut);
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
  stage.before(bar);
  pick(null);
}
