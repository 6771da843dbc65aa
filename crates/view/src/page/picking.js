// What a line of sight meets: rods, rigid bodies, obstacles.

/** Distances along a line, from `from` in direction `along`, at which it meets the triangles of a surface in its own frame. */
function crossings({ positions, triangles }, from, along, visit) {
  const [ax, ay, az] = along;
  for (let t = 0; t < triangles.length; t += 3) {
    const [i, j, k] = [3 * triangles[t], 3 * triangles[t + 1], 3 * triangles[t + 2]];
    const [ox, oy, oz] = [positions[i], positions[i + 1], positions[i + 2]];
    const [ux, uy, uz] = [positions[j] - ox, positions[j + 1] - oy, positions[j + 2] - oz];
    const [vx, vy, vz] = [positions[k] - ox, positions[k + 1] - oy, positions[k + 2] - oz];
    const [px, py, pz] = [ay * vz - az * vy, az * vx - ax * vz, ax * vy - ay * vx];
    const volume = ux * px + uy * py + uz * pz;
    if (volume === 0) continue;
    const [sx, sy, sz] = [from[0] - ox, from[1] - oy, from[2] - oz];
    const u = (sx * px + sy * py + sz * pz) / volume;
    if (u < 0 || u > 1) continue;
    const [qx, qy, qz] = [sy * uz - sz * uy, sz * ux - sx * uz, sx * uy - sy * ux];
    const v = (ax * qx + ay * qy + az * qz) / volume;
    if (v < 0 || u + v > 1) continue;
    visit((vx * qx + vy * qy + vz * qz) / volume);
  }
}

/** Whether an obstacle's surface, which may be open at its ends, is around a place: on both sides along two axes of three. */
function encloses({ surface, centre, turn, radius }, place) {
  const away = subtract(place, centre);
  if (norm(away) > radius) return false;
  const back = [-turn[0], -turn[1], -turn[2], turn[3]];
  const own = turned(back, away);
  const around = [[1, 0.013, 0.017], [0.011, 1, 0.019], [0.023, 0.007, 1]].filter((axis) => {
    let [before, after] = [false, false];
    crossings(surface, own, axis, (t) => (t < 0 ? (before = true) : (after = true)));
    return before && after;
  });
  return around.length >= 2;
}

/** How near a click must be to a rod to mean it, with a mouse and with a finger [px]. */
const NEAR = { mouse: 6, touch: 16 };

/** A line of sight: from an `eye` along a unit vector, in which a pixel at unit distance is so large. */
class Sight {
  constructor(eye, along, pixel) {
    Object.assign(this, { eye, along, pixel });
  }

  /** The thing of `candidates` that is meant: the first one that is met, else the nearest one within `near` pixels. */
  static nearest(candidates, near) {
    const met = candidates.filter(({ off }) => off <= 0).sort((a, b) => a.far - b.far);
    const missed = candidates.filter(({ off }) => off > 0 && off <= near).sort((a, b) => a.off - b.off);
    return met[0] ?? missed[0];
  }

  /** How far away a capsule is, and by how many pixels the line misses it. */
  capsule(start, end, radius) {
    const { eye, along } = this;
    const [span, to] = [subtract(end, start), subtract(start, eye)];
    const [b, c, d, e] = [dot(span, along), dot(span, span), dot(to, along), dot(to, span)];
    const even = c - b * b;
    const s = even > 1e-12 * c ? Math.min(Math.max((b * d - e) / even, 0), 1) : 0;
    const far = d + s * b;
    const away = norm(subtract(add(to, scaled(span, s)), scaled(along, far)));
    return far > 0 ? { far: far - Math.sqrt(Math.max(radius * radius - away * away, 0)), off: (away - radius) / (this.pixel * far) } : null;
  }

  /** How far away a surface at a place and turn is; null where the line misses it. */
  surface(surface, centre, turn) {
    const back = [-turn[0], -turn[1], -turn[2], turn[3]];
    let far = Infinity;
    crossings(surface, turned(back, subtract(this.eye, centre)), turned(back, this.along), (t) => t > 0 && (far = Math.min(far, t)));
    return far < Infinity ? { far, off: 0 } : null;
  }

  /** An obstacle about the origin `centre`. */
  obstacle({ kind, surface, centre, start, end, radius, point, normal, turn }, origin) {
    if (kind === "mesh") return this.surface(surface, subtract(centre, origin), turn);
    if (kind !== "half_space") return this.capsule(subtract(start ?? centre, origin), subtract(end ?? centre, origin), radius);
    const far = dot(subtract(subtract(point, origin), this.eye), normal) / dot(this.along, normal);
    return far > 0 && far < Infinity ? { far, off: 0 } : null;
  }
}

/** What a line of sight means of runs in their frames: its run, and its segment or its obstacle; null for nothing. */
function picked(sight, renderer, runs, frameOf, obstacles, near) {
  const rods = [];
  const others = [];
  for (const run of runs) {
    const { motion, ends, poses } = renderer.runs[run];
    const bodies = new Map(motion.bodies.segment.map((segment, i) => [segment, motion.bodies.surfaces[motion.bodies.surface[i]]]));
    for (let segment = 0; segment < motion.segments; segment++) {
      const [from, at] = [6 * segment, 7 * segment];
      const surface = bodies.get(segment);
      const hit = surface
        ? sight.surface(surface, poses.slice(at, at + 3), poses.slice(at + 3, at + 7))
        : sight.capsule(ends.slice(from, from + 3), ends.slice(from + 3, from + 6), motion.radius[segment]);
      if (hit && hit.off <= near) rods.push({ ...hit, run, segment });
    }
    if (obstacles === "hidden") continue;
    motion.obstacles.forEach((_, obstacle) => {
      const hit = sight.obstacle(motion.obstacleAt(obstacle, frameOf(run)), renderer.centre);
      if (hit && hit.off <= 0) others.push({ ...hit, run, obstacle });
    });
  }
  const [rod, other] = [Sight.nearest(rods, near), Sight.nearest(others, 0)];
  // Through glass one means the rod.
  if (rod && other && obstacles === "solid") return other.far < rod.far ? other : rod;
  return rod ?? other ?? null;
}
