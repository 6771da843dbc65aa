// Vectors as arrays of three numbers, quaternions x, y, z, w, matrices of 16 by columns.

const add = (a, b) => [a[0] + b[0], a[1] + b[1], a[2] + b[2]];
const subtract = (a, b) => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
const scaled = (a, s) => [a[0] * s, a[1] * s, a[2] * s];
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const norm = (a) => Math.hypot(a[0], a[1], a[2]);
const normalized = (a) => scaled(a, 1 / norm(a));

/** Two unit vectors across `axis` and each other. */
function across(axis) {
  const u = normalized(cross(Math.abs(axis[0]) < 0.9 ? [1, 0, 0] : [0, 1, 0], axis));
  return [u, cross(axis, u)];
}

/** A vector turned by a unit quaternion. */
function turned([x, y, z, w], v) {
  const axis = [x, y, z];
  return add(v, scaled(cross(axis, add(cross(axis, v), scaled(v, w))), 2));
}

/** The turn `second` after the turn `first`. */
function composed([x, y, z, w], first) {
  const [axis, other] = [[x, y, z], first.slice(0, 3)];
  const sum = add(add(scaled(other, w), scaled(axis, first[3])), cross(axis, other));
  return [...sum, w * first[3] - dot(axis, other)];
}

/** The shortest turn from z to a unit vector. */
function turnFromZ(axis) {
  if (axis[2] < -0.999999) return [1, 0, 0, 0];
  const q = [-axis[1], axis[0], 0, 1 + axis[2]];
  const length = Math.hypot(...q);
  return q.map((x) => x / length);
}

function multiplied(a, b) {
  const out = new Float32Array(16);
  for (let column = 0; column < 4; column++)
    for (let row = 0; row < 4; row++)
      for (let k = 0; k < 4; k++) out[4 * column + row] += a[4 * k + row] * b[4 * column + k];
  return out;
}

/** Perspective, seen half so high as `slope` times the distance. */
function perspective(slope, aspect, near, far) {
  const out = new Float32Array(16);
  out[0] = 1 / (slope * aspect);
  out[5] = 1 / slope;
  out[10] = (near + far) / (near - far);
  out[11] = -1;
  out[14] = (2 * near * far) / (near - far);
  return out;
}

/** From the world to the axes right, up and back of an eye. */
function viewMatrix(eye, right, up, back) {
  const axes = [right, up, back];
  const out = new Float32Array(16);
  for (let row = 0; row < 3; row++) {
    for (let column = 0; column < 3; column++) out[4 * column + row] = axes[row][column];
    out[12 + row] = -dot(axes[row], eye);
  }
  out[15] = 1;
  return out;
}
