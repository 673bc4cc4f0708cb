// A reader of a page of results, who takes STEPS and looks at the colours of PLACES.
const wait = (milliseconds) => new Promise((done) => setTimeout(done, milliseconds));
const byId = (id) => document.getElementById(id);
const choose = async (id, value) => { byId(id).value = value; byId(id).dispatchEvent(new Event("change")); await wait(150); };
const model = (name) => Bokeh.documents.map((one) => one.get_model_by_name(name)).find((one) => one);
const view = () => Object.values(Bokeh.index).concat(Bokeh.index.roots ?? []).find((one) => one?.model?.name === "map");
const colour = (x, y) => { // of the place at this part of both sides
  const layer = view().export("png", true).canvas, { left, top, width, height } = view().frame.bbox, scale = layer.width / view().bbox.width;
  const [r, g, b] = layer.getContext("2d").getImageData(scale * (left + x * width), scale * (top + (1 - y) * height), 1, 1).data;
  return "#" + [r, g, b].map((part) => part.toString(16).padStart(2, "0")).join("");
};
const seen = () => ({
  place: byId("place").textContent, facts: byId("facts").textContent, key: byId("key").textContent,
  reading: byId("reading").textContent, now: model("now").location, colours: PLACES.map(([x, y]) => colour(x, y)),
});
while (!document.body.dataset.ready) await wait(50);
await wait(150);
const found = [];
for (const [id, value] of STEPS) {
  if (id === "row") { byId("row").value = value; byId("row").dispatchEvent(new Event("input")); await wait(150); }
  else if (id === "key") { document.body.dispatchEvent(new KeyboardEvent("keydown", { key: value, bubbles: true })); await wait(150); }
  else if (id === "point") { dispatchEvent(new CustomEvent("place", { detail: { plot: "map", kind: "move", x: value[0], y: value[1] } })); await wait(50); }
  else await choose(id, value);
  found.push(seen());
}
document.body.innerHTML = "";
const result = document.createElement("pre");
result.id = "result";
result.textContent = JSON.stringify({ found, complaints, title: document.title });
document.body.append(result);
