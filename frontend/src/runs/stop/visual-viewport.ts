/** Keeps an element over what is seen of the page: zoomed by two fingers, above a keyboard, in a page too wide. */

const SIZES = ["transform", "width", "height"] as const;

/**
 * Lay `layer`, which is fixed at the upper left, over the visual viewport, at the size that it has
 * without zoom. Return what ends that.
 */
export function followVisualViewport(layer: HTMLElement): () => void {
  const seen = window.visualViewport;
  if (seen == null) return () => {};
  const place = () => {
    const { offsetLeft, offsetTop, width, height, scale } = seen;
    const whole =
      scale === 1 && width === window.innerWidth && height === window.innerHeight && !offsetTop;
    if (whole) for (const name of SIZES) layer.style.removeProperty(name);
    else {
      layer.style.transform = `translate(${offsetLeft}px, ${offsetTop}px) scale(${1 / scale})`;
      layer.style.width = `${width * scale}px`;
      layer.style.height = `${height * scale}px`;
    }
  };
  place();
  const on = [
    [seen, "resize"],
    [seen, "scroll"],
    [window, "resize"],
  ] as const;
  for (const [target, name] of on) target.addEventListener(name, place);
  return () => {
    for (const [target, name] of on) target.removeEventListener(name, place);
  };
}
