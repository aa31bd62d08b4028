const kViews = [["+x", "+X"], ["-x", "−X"], ["+y", "+Y"], ["-y", "−Y"], ["+z", "+Z"], ["-z", "−Z"]];

/**
 * @param {object} props
 * @param {import("../types.js").Camera} props.camera
 * @param {(view?: string) => void} props.onView
 * @param {(parallel: boolean) => void} props.onParallel
 */
export function ViewButtons({ camera, onView, onParallel }) {
  const parallel = camera.height !== undefined;
  return (
    <div class="view-buttons" role="group" aria-label="Views">
      <button type="button" onClick={() => onView()} title="Show all of the volume (key 0)">Fit</button>
      {kViews.map(([view, text]) => (
        <button key={view} type="button" aria-label={`View from ${text}`} title={`View from ${text}`} onClick={() => onView(view)}>
          {text}
        </button>
      ))}
      <button
        type="button" aria-pressed={parallel} onClick={() => onParallel(!parallel)}
        title="Parallel rays: no perspective, so that equal lengths look equal"
      >
        Parallel
      </button>
    </div>
  );
}
