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
  drag([[2 - strip.half, 3], [strip.half - 0.1, 3]]);
  answers.warns = field("verdict").textContent.startsWith("The strip fell");
  // Back to both sides of the place where the sag comes off, and on to the fall again.
  answers.loop = ASKED.loop.map((advance) => {
    drag([[advance - strip.half, 3]]);
    return [state.touches, Boolean(fell), field("verdict").textContent.startsWith("The sag came off")];
  });
  field("height").value = 3;
  field("paper").click();
  const places = chosenPath();
  playing = 0;
  answers.paper = [];
  for (const place of places) {
    moveTo(...place);
    const event = fell ? "fell" : cameOff ? "came off" : "free";
    if (answers.paper[answers.paper.length - 1] !== event) answers.paper.push(event);
  }
  // Where it stops it says why; an invalid length says so beside the field and leaves the picture.
  field("reset").click();
  for (let i = 0; i < 3; i++) view.dispatchEvent(new KeyboardEvent("keydown", { key: "ArrowUp" }));
  answers.stopped = field("verdict").textContent;
  const picture = field("scene").innerHTML;
  type("length", 0.01);
  answers.refusal = field("inputs").textContent.includes("can be") && field("scene").innerHTML === picture;
  type("length", ASKED.length * star);
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
  for (let i = 0; i < 5; i++) view.dispatchEvent(new KeyboardEvent("keydown", { key: "ArrowDown" }));
  answers.lowest = field("verdict").textContent;
  // A narrow screen: what sticks out of it, in pixels.
  const frame = document.createElement("iframe");
  frame.style.width = `${ASKED.narrow}px`;
  frame.src = "page.html";
  document.body.append(frame);
  await new Promise((done) => frame.addEventListener("load", done));
  answers.narrow = frame.contentDocument.documentElement.scrollWidth - frame.contentWindow.innerWidth;
  const height = (id) => frame.contentDocument.getElementById(id).getBoundingClientRect().height;
  answers.phone = [height("view"), height("inputs")];
  return answers;
}

answer().catch((error) => ({ error: String(error) })).then((answers) => {
  const shown = document.createElement("pre");
  shown.id = "answers";
  shown.textContent = JSON.stringify(answers);
  document.body.append(shown);
});
