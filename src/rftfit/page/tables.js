// Tables that sort by a click on a heading; long ones are filtered by words.

/** What a cell sorts by: its number, else its text. */
function sortKey(row, column) {
  const text = row.cells[column]?.firstChild?.textContent.trim() || "";
  const number = parseFloat(text.replace(MINUS, "-"));
  return Number.isFinite(number) && /^[+\u2212-]?[\d.]/.test(text) ? number : text.toLowerCase();
}

/** Order of two keys of `sortKey`: numbers before text. */
function compareKeys(a, b) {
  if (typeof a === typeof b) return a < b ? -1 : a > b ? 1 : 0;
  return typeof a === "number" ? -1 : 1;
}

/** Make each heading of a table a button that sorts its rows. */
function makeSortable(table) {
  const heads = [...table.tHead.rows[0].cells];
  const body = table.tBodies[0];
  for (const head of heads) {
    const button = html("button", { type: "button", class: "sort" }, ...head.childNodes);
    head.replaceChildren(button);
    button.addEventListener("click", () => {
      const up = head.getAttribute("aria-sort") !== "ascending";
      for (const other of heads) other.removeAttribute("aria-sort");
      head.setAttribute("aria-sort", up ? "ascending" : "descending");
      const keyed = [...body.rows].map((row) => [sortKey(row, head.cellIndex), row]);
      keyed.sort(([a], [b]) => (up ? compareKeys(a, b) : compareKeys(b, a)));
      body.append(...keyed.map(([, row]) => row));
    });
  }
}

/** Put a field above a long table that shows only rows with all typed words. */
function makeFilter(frame) {
  const rows = [...frame.querySelectorAll("tbody tr")];
  const input = html("input", { type: "search", spellcheck: "false" });
  const count = html("span", { class: "note", role: "status" });
  const show = () => {
    const words = input.value.toLowerCase().split(/\s+/).filter(Boolean);
    let shown = 0;
    for (const row of rows) {
      const text = row.textContent.toLowerCase();
      row.hidden = !words.every((word) => text.includes(word));
      if (!row.hidden) shown += 1;
    }
    count.textContent = `${shown} of ${rows.length} rows`;
  };
  input.addEventListener("input", show);
  frame.before(html("div", { class: "controls filter" }, html("label", {}, `${frame.dataset.filter}: rows with the words`, input), count));
  show();
}

function startTables() {
  for (const table of document.querySelectorAll("main .scroll > table")) if (table.tBodies[0].rows.length > 2) makeSortable(table);
  for (const frame of document.querySelectorAll(".scroll[data-filter]")) makeFilter(frame);
}
