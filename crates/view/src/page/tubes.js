// Tubes: one instance a segment, one draw call a set.

/** 32-bit words of an instance: start, its frame, end, its frame, colour. */
const WORDS = 15;

class TubeSet {
  constructor(gl, count, detail) {
    this.gl = gl;
    this.count = count;
    this.floats = new Float32Array(count * WORDS);
    this.words = new Uint32Array(this.floats.buffer);
    const mesh = tubeMesh(detail);
    this.indices = mesh.triangles.length;
    this.array = gl.createVertexArray();
    gl.bindVertexArray(this.array);
    this.#buffer(gl.ARRAY_BUFFER, mesh.vertices, gl.STATIC_DRAW);
    this.#attribute(0, 4, 16, 0, 0);
    this.#buffer(gl.ELEMENT_ARRAY_BUFFER, mesh.triangles, gl.STATIC_DRAW);
    this.instances = this.#buffer(gl.ARRAY_BUFFER, this.floats, gl.DYNAMIC_DRAW);
    [3, 4, 3, 4].reduce((offset, size, k) => {
      this.#attribute(k + 1, size, 4 * WORDS, offset, 1);
      return offset + 4 * size;
    }, 0);
    gl.enableVertexAttribArray(5);
    gl.vertexAttribPointer(5, 4, gl.UNSIGNED_BYTE, true, 4 * WORDS, 56);
    gl.vertexAttribDivisor(5, 1);
    this.shapes = this.#buffer(gl.ARRAY_BUFFER, new Float32Array(4 * count), gl.STATIC_DRAW);
    this.#attribute(6, 4, 16, 0, 1);
    gl.bindVertexArray(null);
  }

  #buffer(target, data, usage) {
    const buffer = this.gl.createBuffer();
    this.gl.bindBuffer(target, buffer);
    this.gl.bufferData(target, data, usage);
    return buffer;
  }

  #attribute(place, size, stride, offset, divisor) {
    this.gl.enableVertexAttribArray(place);
    this.gl.vertexAttribPointer(place, size, this.gl.FLOAT, false, stride, offset);
    this.gl.vertexAttribDivisor(place, divisor);
  }

  /** Radii at both ends [m] and whether they are free, four numbers a segment. */
  setShapes(shapes) {
    this.gl.bindBuffer(this.gl.ARRAY_BUFFER, this.shapes);
    this.gl.bufferSubData(this.gl.ARRAY_BUFFER, 0, shapes);
  }

  /** Brings `floats` and `words` to the graphics processor. */
  upload() {
    this.gl.bindBuffer(this.gl.ARRAY_BUFFER, this.instances);
    this.gl.bufferSubData(this.gl.ARRAY_BUFFER, 0, this.floats);
  }

  draw() {
    this.gl.bindVertexArray(this.array);
    this.gl.drawElementsInstanced(this.gl.TRIANGLES, this.indices, this.gl.UNSIGNED_SHORT, 0, this.count);
    this.gl.bindVertexArray(null);
  }
}

/** The tubes of a run, about `centre`. */
class RunTubes {
  constructor(gl, motion, centre) {
    this.motion = motion;
    this.centre = centre;
    this.tubes = new TubeSet(gl, motion.segments, detailFor(motion.segments));
    this.poses = new Float64Array(7 * motion.segments);
    this.ends = new Float64Array(6 * motion.segments);
    this.previous = new Int32Array(motion.segments).fill(-1);
    this.bodies = new RunBodies(gl, motion.bodies);
    motion.next.forEach((next, i) => {
      if (next !== null) this.previous[next] = i;
    });
    const { radius, next } = motion;
    const shapes = new Float32Array(4 * motion.segments);
    for (let i = 0; i < motion.segments; i++) {
      const [before, after] = [this.previous[i], next[i]];
      shapes[4 * i] = before < 0 ? radius[i] : (radius[i] + radius[before]) / 2;
      shapes[4 * i + 1] = after === null ? radius[i] : (radius[i] + radius[after]) / 2;
      shapes[4 * i + 2] = before < 0 ? 1 : 0;
      shapes[4 * i + 3] = after === null ? 1 : 0;
    }
    // Rigid bodies are no tubes: what would be one is a point in their middle.
    this.half = motion.length.map((length) => length / 2);
    for (const i of motion.bodies.segment) {
      this.half[i] = 0;
      shapes.fill(0, 4 * i, 4 * i + 4);
    }
    this.tubes.setShapes(shapes);
  }

  /** Moves the tubes to a frame; `colouring` gives the colour of a frame's segment, as a word. */
  update(frame, colouring) {
    const { motion, poses, ends, centre } = this;
    const { floats, words } = this.tubes;
    for (let i = 0; i < motion.segments; i++) {
      const p = 7 * i;
      motion.readPosition(frame, i, poses, p);
      motion.readOrientation(frame, i, poses, p + 3);
      const [x, y, z, w] = [poses[p + 3], poses[p + 4], poses[p + 5], poses[p + 6]];
      const half = this.half[i];
      const axis0 = 2 * (x * z + w * y) * half;
      const axis1 = 2 * (y * z - w * x) * half;
      const axis2 = (1 - 2 * (x * x + y * y)) * half;
      for (let k = 0; k < 3; k++) poses[p + k] -= centre[k];
      ends[6 * i] = poses[p] - axis0;
      ends[6 * i + 1] = poses[p + 1] - axis1;
      ends[6 * i + 2] = poses[p + 2] - axis2;
      ends[6 * i + 3] = poses[p] + axis0;
      ends[6 * i + 4] = poses[p + 1] + axis1;
      ends[6 * i + 5] = poses[p + 2] + axis2;
    }
    for (let i = 0; i < motion.segments; i++) {
      const at = WORDS * i;
      const next = motion.next[i] ?? -1;
      this.#end(i, 0, this.previous[i], at);
      this.#end(i, 1, next, at + 7);
      let along = 0;
      for (let k = 3; k < 7; k++) along += floats[at + k] * floats[at + 7 + k];
      if (along < 0) for (let k = 3; k < 7; k++) floats[at + 7 + k] *= -1;
      words[at + 14] = colouring(frame, i);
    }
    this.bodies.update(poses, (segment) => words[WORDS * segment + 14]);
    this.tubes.upload();
  }

  /** Whether a neighbour's end is not so far away that the joint to it must have broken: by three times both halves of the segment. */
  #isNear(i, side, neighbour) {
    const { ends, half } = this;
    let squared = 0;
    for (let k = 0; k < 3; k++) squared += (ends[6 * i + 3 * side + k] - ends[6 * neighbour + 3 * (1 - side) + k]) ** 2;
    return squared <= (3 * half[i] + 3 * half[neighbour]) ** 2 || half[i] === 0 || half[neighbour] === 0;
  }

  /** Place and frame at an end of a segment: the mean of its own and those of the neighbour there, if they are joined. */
  #end(i, side, neighbour, at) {
    const { poses, ends } = this;
    const { floats } = this.tubes;
    const isJoined = neighbour >= 0 && this.#isNear(i, side, neighbour);
    const other = isJoined ? neighbour : i;
    const otherSide = isJoined ? 1 - side : side;
    for (let k = 0; k < 3; k++) floats[at + k] = (ends[6 * i + 3 * side + k] + ends[6 * other + 3 * otherSide + k]) / 2;
    const [p, q] = [7 * i + 3, 7 * other + 3];
    let along = 0;
    for (let k = 0; k < 4; k++) along += poses[p + k] * poses[q + k];
    const sign = along < 0 ? -1 : 1;
    let square = 0;
    for (let k = 0; k < 4; k++) {
      const sum = poses[p + k] + sign * poses[q + k];
      floats[at + 3 + k] = sum;
      square += sum * sum;
    }
    const scale = 1 / Math.sqrt(square);
    for (let k = 3; k < 7; k++) floats[at + k] *= scale;
  }
}
