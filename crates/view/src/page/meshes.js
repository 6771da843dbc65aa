// The mesh of one segment: rings along it, and the rings of a cap at each end, which lie on the end's ring where a
// segment goes on.

/** Finer for few segments than for thousands. */
function detailFor(segments) {
  if (segments > 3000) return { sides: 8, rings: 2, caps: 1 };
  return segments > 800 ? { sides: 10, rings: 3, caps: 2 } : { sides: 18, rings: 6, caps: 4 };
}

const OBSTACLE_DETAIL = { sides: 64, rings: 2, caps: 16 };

/** `ring` attributes (place along the segment, height on a cap, cosine, sine) and triangles. */
function tubeMesh({ sides, rings, caps }) {
  const places = [];
  const cap = (k) => Math.sin((0.5 * Math.PI * k) / caps);
  for (let k = caps; k > 0; k--) places.push([0, -cap(k)]);
  for (let k = 0; k < rings; k++) places.push([k / (rings - 1), 0]);
  for (let k = 1; k <= caps; k++) places.push([1, cap(k)]);
  const vertices = [];
  const triangles = [];
  places.forEach(([along, height], ring) => {
    for (let side = 0; side <= sides; side++) {
      const angle = (2 * Math.PI * side) / sides;
      vertices.push(along, height, Math.cos(angle), Math.sin(angle));
      if (ring === 0 || side === 0) continue;
      const here = ring * (sides + 1) + side;
      const below = here - sides - 1;
      triangles.push(below - 1, below, here, below - 1, here, here - 1);
    }
  });
  return { vertices: new Float32Array(vertices), triangles: new Uint16Array(triangles) };
}
