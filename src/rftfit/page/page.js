// Start the live parts. Each stands on its own: one that fails says so and leaves the others alive.

const data = JSON.parse(byId("data").textContent);

function startPart(id, part) {
  try {
    part(data);
  } catch (error) {
    console.error(error);
    byId(id).append(html("p", { class: "bad" }, `This part could not start: ${error.message}`));
  }
}

startPart("summary", startTables);
startPart("maps", startMaps);
if (byId("viewer")) startPart("viewer", startViewer);
startPart("calculator", startCalculator);
if (data.robot) startPart("robot", startRobot);

// who follows a link to a part sees it open
function openTarget() {
  const target = location.hash && byId(decodeURIComponent(location.hash.slice(1)));
  if (!target) return;
  for (const folded of [target.querySelector("details.tool"), target.closest("details")]) if (folded) folded.open = true;
}
addEventListener("hashchange", openTarget);
openTarget();

byId("methods-copy").addEventListener("click", async () => {
  const text = byId("methods-text");
  try {
    await navigator.clipboard.writeText(text.innerText);
    byId("methods-copied").textContent = "Copied.";
  } catch {
    // without the right to the clipboard the text is selected for the reader's own copy
    getSelection().selectAllChildren(text);
    byId("methods-copied").textContent = "Selected: copy it with the keyboard.";
  }
});

// for those who want the numbers behind the page: the functions that draw it
window.rftfit = { data, alphaOf, elementForces, netForce, sweepLeg, scaleNewMedium, scaledCoefficients, scaledAlpha, scaledSweep, readPush, scaleMap };
