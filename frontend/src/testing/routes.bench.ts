/** Measures how long routing takes: a whole scene, and after one card has moved. `make bench ARGS=arrows`. */
import { bench, describe } from "vitest";
import { routed } from "../canvas/arrows/routes";
import { simpleLines } from "../canvas/arrows/simple-lines";
import { layeredScene, seeded } from "./scenes";

const OPTIONS = { time: 0, iterations: 5, warmupTime: 0, warmupIterations: 1 };

for (const count of [60, 300, 1000]) {
  describe(`${count} cards`, () => {
    const scene = layeredScene(count, seeded(count), "right");
    const { ways } = routed(scene);
    let at = 0;
    bench("first paint", () => void simpleLines(scene), OPTIONS);
    bench("whole", () => void routed(scene), OPTIONS);
    bench(
      "one card moved",
      () => {
        at = (at + 37) % count;
        const cards = scene.cards.map((card, i) =>
          i === at ? { ...card, x: card.x + 7, y: card.y + 18 } : card,
        );
        routed({ ...scene, cards }, ways);
      },
      OPTIONS,
    );
  });
}
