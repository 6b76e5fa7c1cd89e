// Show results of the last verification on every page, and the rows of a table on its page: the address selects rows, buttons sort them.
"use strict";

const SHOWN = 100;
const TAKES = ["max", "min", "median", "count", "distinct"];

// Return the rows of a CSV text; a quoted cell may contain commas, quotes and line ends.
function parse(text) {
  const rows = [];
  let row = [], cell = "", quoted = false;
  for (let i = 0; i < text.length; i++) {
    const sign = text[i];
    if (quoted) {
      if (sign !== '"') cell += sign;
      else if (text[i + 1] === '"') { cell += sign; i++; }
      else quoted = false;
    } else if (sign === '"') quoted = true;
    else if (sign === ",") { row.push(cell); cell = ""; }
    else if (sign === "\n") { row.push(cell); rows.push(row); row = []; cell = ""; }
    else if (sign !== "\r") cell += sign;
  }
  return rows;
}

// Parse a key as in the manuscript: column=value|column!=value|column|aggregate.
function asked(key) {
  const found = { filters: [], column: null, take: null };
  for (const part of key.split("|").filter(Boolean)) {
    const filter = /^(.*?)(!?=)(.*)$/.exec(part);
    if (filter) found.filters.push(filter.slice(1));
    else if (found.column !== null && TAKES.includes(part)) found.take = part;
    else found.column = part;
  }
  return found;
}

// Return the key in the address; "" if the address ends within an encoded character.
function keyOfAddress() {
  try {
    return decodeURIComponent(location.hash.slice(1));
  } catch {
    return "";
  }
}

function same(cell, value) {
  return cell === value || (cell !== "" && value !== "" && Number(cell) === Number(value));
}

// Return the indices of the rows that satisfy a key.
function matching(table, key) {
  const { filters } = asked(key), places = filters.map((filter) => table.head.indexOf(filter[0]));
  return table.rows.map((_, i) => i).filter((i) => filters.every(([, sign, value], f) =>
    same(filters[f][0] === "row" ? String(i + 1) : table.rows[i][places[f]] ?? "", value) === (sign === "=")));
}

async function unpacked(base64) {
  const bytes = Uint8Array.from(atob(base64), (sign) => sign.charCodeAt(0));
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"));
  return new Response(stream).text();
}

function element(name, text, parent) {
  const made = document.createElement(name);
  made.textContent = text;
  parent.append(made);
  return made;
}

async function showTable(name) {
  const text = await unpacked(document.getElementById("data").textContent);
  const [head, ...rows] = parse(text), table = { head, rows };
  const $ = (id) => document.getElementById(id);
  let chosen = [], start = 0, order = null;
  const choose = () => {
    const words = $("filter").value.toLowerCase(), key = keyOfAddress(), { column, take, filters } = asked(key);
    chosen = matching(table, key).filter((i) => rows[i].join(" ").toLowerCase().includes(words));
    if (order) {
      const value = (i) => rows[i][order.column], sign = order.down ? -1 : 1;
      const compare = (a, b) => (a !== "" && b !== "" && !isNaN(a) && !isNaN(b) ? a - b : a.localeCompare(b));
      chosen.sort((i, j) => sign * compare(value(i), value(j)) || i - j);
    }
    start = 0;
    const places = filters.map((filter) => filter.join(" ").replace(" = ", ": ").replace(" != ", " is not "));
    $("asked").textContent = column || places.length
      ? `${take ? `Shown: ${take} of ` : "Shown: "}${column ?? "all columns"} ${places.length ? `in rows with ${places.join(", ")}` : "in all rows"}.` : "";
    $("every").hidden = !location.hash;
    const about = column === null ? null : $("columns").querySelector(`tr[data-column="${CSS.escape(column)}"]`);
    const gone = [column, ...filters.map(([name]) => name)].filter((name) => name !== null && ![...head, "row"].includes(name));
    const [meaning, unit, kind, tolerance] = [...(about?.cells ?? [])].slice(1).map((cell) => cell.textContent);
    $("column").textContent = about ? `${column}: ${meaning}${unit && `, ${unit}`}. Tolerance of ./reproduce verify: ${tolerance} (kind of column: ${kind}).`
      : gone.length ? `This table has no column ${gone.join(", ")}.` : "";
    show();
  };
  const show = () => {
    const { column } = asked(keyOfAddress()), body = document.createElement("tbody"), top = document.createElement("thead");
    const line = element("tr", "", top);
    element("th", "row", line).scope = "col";
    head.forEach((title, place) => {
      const cell = element("th", "", line);
      cell.scope = "col";
      cell.classList.toggle("asked", title === column);
      if (order?.column === place) cell.ariaSort = order.down ? "descending" : "ascending";
      const button = element("button", title, cell);
      button.title = $("columns").querySelector(`tr[data-column="${CSS.escape(title)}"]`)?.cells[1].textContent ?? "";
      button.onclick = () => {
        order = { column: place, down: order?.column === place && !order.down };
        choose();
        $("rows").querySelectorAll("button")[place].focus(); // the pressed button was replaced
      };
    });
    for (const i of chosen.slice(start, start + SHOWN)) {
      const made = element("tr", "", body);
      element("td", String(i + 1), made);
      rows[i].forEach((cell, place) => { const one = element("td", cell, made); one.classList.toggle("long", cell.length > 40); one.classList.toggle("asked", head[place] === column); });
    }
    $("rows").replaceChildren(top, body);
    $("range").textContent = chosen.length ? `${start + 1} to ${Math.min(start + SHOWN, chosen.length)} of ${chosen.length}` : "no rows";
    $("before").disabled = start === 0;
    $("after").disabled = start + SHOWN >= chosen.length;
    $("rows").querySelector("th.asked")?.scrollIntoView({ block: "nearest", inline: "center" });
  };
  $("filter").oninput = choose;
  $("before").onclick = () => { start -= SHOWN; show(); };
  $("after").onclick = () => { start += SHOWN; show(); };
  $("every").onclick = () => { history.pushState(null, "", location.pathname); choose(); };
  $("csv").href = URL.createObjectURL(new Blob([text], { type: "text/csv" }));
  window.onhashchange = choose;
  window.pdromTable = { table, matching: (key) => matching(table, key) };
  choose();
}

function showVerified(place, name) {
  place.textContent = window.pdromVerified?.[name] ?? "not yet run";
}

for (const place of document.querySelectorAll("[data-verified]")) showVerified(place, place.dataset.verified);
const page = document.getElementById("table");
if (page) showTable(page.dataset.name).catch(() => {
  document.getElementById("asked").textContent = "The rows cannot be read, because this file was truncated or changed. ./reproduce article writes it again.";
});
for (const place of document.querySelectorAll('math[display="inline"]')) {
  if (place.getBoundingClientRect().right > innerWidth) { place.classList.add("wide"); place.tabIndex = 0; }
}
const contents = document.querySelector(".toc details");
if (contents && matchMedia("(max-width: 999px)").matches) contents.open = false;
