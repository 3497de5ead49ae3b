"use strict";
// Drives the page as a reader would and writes what it shows as JSON into the page; ASKED is what to do, in L*.

function drag(places) {
  const send = (name, [x, z]) => {
    const at = new DOMPoint(x, -z).matrixTransform(view.getScreenCTM());
    view.dispatchEvent(new PointerEvent(name, { clientX: at.x, clientY: at.y, bubbles: true }));
  };
  send("pointerdown", gripper);
  for (const place of places) send("pointermove", place);
  send("pointerup", places[places.length - 1]);
}

/** Points on all of the drawn strip. */
function drawn() {
  const points = [];
  for (const path of document.querySelectorAll(".strip")) {
    const length = path.getTotalLength();
    for (let i = 0; i <= ASKED.points; i++) {
      const { x, y } = path.getPointAtLength((length * i) / ASKED.points);
      points.push([x, -y]);
    }
  }
  return points;
}

function type(id, value) {
  field(id).value = value;
  field(id).dispatchEvent(new Event("input"));
}

async function answer() {
  const eta = 3780, star = (eta * GRAVITY) ** (-1 / 3);
  type("material", eta);
  type("length", ASKED.length * star);
  const answers = { drawn: [] };
  for (const way of ASKED.ways) {
    field("reset").click();
    drag(way);
    answers.drawn.push(drawn());
  }
  // A fall: carried over at a height of 3 L*.
  field("reset").click();
  drag([[2 - strip.half, 3], [strip.half, 3]]);
  answers.warns = field("verdict").textContent.startsWith("The strip fell");
  answers.falls = ["triangular", "circular", "r-path", "low"].filter((name) => {
    field("reset").click();
    drag(strip.path(name));
    return fell;
  });
  // The keyboard.
  field("reset").click();
  drag([[0.3 - strip.half, 1]]);
  const before = gripper[0];
  view.dispatchEvent(new KeyboardEvent("keydown", { key: "ArrowRight" }));
  answers.keyboard = gripper[0] - before;
  // A narrow screen: what sticks out of it, in pixels.
  const frame = document.createElement("iframe");
  frame.style.width = `${ASKED.narrow}px`;
  frame.src = "page.html";
  document.body.append(frame);
  await new Promise((done) => frame.addEventListener("load", done));
  answers.narrow = frame.contentDocument.documentElement.scrollWidth - frame.contentWindow.innerWidth;
  return answers;
}

answer().catch((error) => ({ error: String(error) })).then((answers) => {
  const shown = document.createElement("pre");
  shown.id = "answers";
  shown.textContent = JSON.stringify(answers);
  document.body.append(shown);
});
