// Rigid bodies, and obstacles of triangles: one mesh each, moved with its segment or by itself.

const BODY_VERTEX = `#version 300 es
layout(location = 0) in vec3 corner;
layout(location = 1) in vec3 outwards;
uniform mat4 toClip;
uniform vec3 centre;
uniform vec4 frame;
uniform vec3 paint;
uniform vec4 plane;                       // of shadows: normal, offset
uniform vec3 light;
out vec3 place;
out vec3 normal;
out vec2 around;
out float wide;
flat out vec3 base;

vec3 turned(vec4 q, vec3 v) { return v + 2.0 * cross(q.xyz, cross(q.xyz, v) + q.w * v); }

void main() {
  place = centre + turned(frame, corner);
  normal = turned(frame, outwards);
  around = vec2(-1, 0);
  wide = 1e3;
  base = paint;
  #ifdef SHADOW
  place -= light * ((dot(plane.xyz, place) - plane.w) / dot(plane.xyz, light));
  #endif
  gl_Position = toClip * vec4(place, 1.0);
}`;

/** A colour's word as red, green and blue from 0 to 1. */
function shares(word) {
  return [0, 8, 16].map((shift) => ((word >>> shift) & 255) / 255);
}

/** The rigid bodies of a run; or meshes that are numbered as segments are. */
class RunBodies {
  constructor(gl, { segment, surface, surfaces }) {
    this.gl = gl;
    const meshes = surfaces.map((mesh) => this.#mesh(mesh));
    this.all = segment.map((segment, i) => ({ segment, mesh: meshes[surface[i]], pose: new Float32Array(7), paint: [0, 0, 0] }));
  }

  #mesh({ positions, normals, triangles }) {
    const { gl } = this;
    const array = gl.createVertexArray();
    gl.bindVertexArray(array);
    [positions, normals].forEach((numbers, place) => {
      gl.bindBuffer(gl.ARRAY_BUFFER, gl.createBuffer());
      gl.bufferData(gl.ARRAY_BUFFER, new Float32Array(numbers), gl.STATIC_DRAW);
      gl.enableVertexAttribArray(place);
      gl.vertexAttribPointer(place, 3, gl.FLOAT, false, 0, 0);
    });
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, gl.createBuffer());
    gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, new Uint32Array(triangles), gl.STATIC_DRAW);
    gl.bindVertexArray(null);
    return { array, count: triangles.length };
  }

  /** Moves the bodies: `poses` has seven numbers a segment, `colour` gives its colour as a word. */
  update(poses, colour) {
    for (const body of this.all) {
      for (let k = 0; k < 7; k++) body.pose[k] = poses[7 * body.segment + k];
      body.paint = shares(colour(body.segment));
    }
  }

  /** Gives all of them one colour, a word. */
  paint(colour) {
    for (const body of this.all) body.paint = shares(colour);
  }

  /** Draws them with a program whose uniforms are at `places`. */
  draw(places) {
    const { gl } = this;
    for (const { mesh, pose, paint } of this.all) {
      gl.uniform3fv(places.centre, pose.subarray(0, 3));
      gl.uniform4fv(places.frame, pose.subarray(3, 7));
      if (places.paint) gl.uniform3fv(places.paint, paint);
      gl.bindVertexArray(mesh.array);
      gl.drawElements(gl.TRIANGLES, mesh.count, gl.UNSIGNED_INT, 0);
    }
    gl.bindVertexArray(null);
  }
}
