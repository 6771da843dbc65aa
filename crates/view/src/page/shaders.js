// Programs of the graphics processor.

/** Noise-free helpers that both vertex programs of tubes share: where a point of the tube is. */
const TUBE_VERTEX = `#version 300 es
layout(location = 0) in vec4 ring;        // place along the segment, height on a cap (-1 to 1), cosine, sine
layout(location = 1) in vec3 start;
layout(location = 2) in vec4 startFrame;
layout(location = 3) in vec3 end;
layout(location = 4) in vec4 endFrame;
layout(location = 5) in vec4 colour;
layout(location = 6) in vec4 shape;       // radii at both ends, whether each end is free
uniform mat4 toClip;
uniform float pixel;                      // size of a pixel at unit distance
uniform vec4 plane;                       // of shadows: normal, offset
uniform vec3 light;
out vec3 place;
out vec3 normal;
out vec2 around;
out float wide;                           // radius in pixels
flat out vec3 base;

vec3 turned(vec4 q, vec3 v) { return v + 2.0 * cross(q.xyz, cross(q.xyz, v) + q.w * v); }

void main() {
  float s = ring.x;
  float span = distance(start, end);
  vec3 a = turned(startFrame, vec3(0, 0, span));
  vec3 b = turned(endFrame, vec3(0, 0, span));
  float t = 1.0 - s;
  vec3 centre = t * t * (1.0 + 2.0 * s) * start + s * t * t * a + s * s * (3.0 - 2.0 * s) * end - s * s * t * b;
  vec3 slope = 6.0 * s * t * (end - start) + t * (1.0 - 3.0 * s) * a + s * (3.0 * s - 2.0) * b;
  vec4 frame = normalize(mix(startFrame, endFrame, s));
  vec3 axis = span > 0.0 ? normalize(slope) : turned(frame, vec3(0, 0, 1));
  vec3 d1 = turned(frame, vec3(1, 0, 0));
  d1 = normalize(d1 - axis * dot(axis, d1));
  vec3 radial = ring.z * d1 + ring.w * cross(axis, d1);
  float height = ring.y * (ring.y < 0.0 ? shape.z : shape.w);
  float width = sqrt(max(1.0 - height * height, 0.0));
  float distanceToEye = (toClip * vec4(centre, 1.0)).w;
  float radius = max(mix(shape.x, shape.y, s), pixel * distanceToEye);
  wide = radius / (pixel * distanceToEye);
  normal = radial * width + axis * height;
  place = centre + radius * normal;
  around = ring.zw;
  base = colour.rgb;
  #ifdef SHADOW
  place -= light * ((dot(plane.xyz, place) - plane.w) / dot(plane.xyz, light));
  #endif
  gl_Position = toClip * vec4(place, 1.0);
}`;

const TUBE_FRAGMENT = `#version 300 es
precision highp float;
in vec3 place;
in vec3 normal;
in vec2 around;
in float wide;
flat in vec3 base;
uniform vec3 eye;
uniform vec3 light;
uniform float stripe;                     // 0: none; otherwise how light it is
uniform float glass;                      // 0: opaque; otherwise how much is seen of it where one looks straight at it
out vec4 result;

void main() {
  vec3 n = normalize(normal);
  vec3 v = normalize(eye - place);
  // Of what is open one sees the inside.
  if (dot(n, v) < 0.0) n = -n;
  vec3 paint = pow(base, vec3(2.2));
  // A tube of a few pixels shows neither stripe nor dark edges. It is thin all along, or nowhere: no dashes.
  float angle = abs(atan(around.y, around.x));
  float soft = clamp(1.0 / wide, 0.02, 0.3);
  float thick = smoothstep(1.5, 4.0, wide);
  if (stripe > 0.0) {
    float inside = 1.0 - smoothstep(0.34 - soft, 0.34 + soft, angle);
    paint = mix(paint, vec3(stripe), 0.7 * inside * thick);
  }
  float sun = max(dot(n, light), 0.0);
  float sky = 0.5 + 0.5 * n.z;
  float facing = max(dot(n, v), 0.0);
  float gloss = pow(max(dot(n, normalize(light + v)), 0.0), 40.0);
  float edge = mix(mix(0.85, 0.5, thick), 1.0, smoothstep(0.0, 0.45, facing));
  vec3 lit = paint * (0.6 * sun + mix(0.25, 0.5, sky) + 0.25 * facing) * edge;
  float alpha = glass > 0.0 ? mix(0.6, glass, smoothstep(0.0, 0.7, facing)) : 1.0;
  result = vec4(pow(lit + 0.06 * gloss, vec3(1.0 / 2.2)), alpha);
}`;

const SHADOW_FRAGMENT = `#version 300 es
precision highp float;
in vec3 place;
uniform vec4 shadow;                      // colour and strength
uniform vec4 middle;                      // centre of the ground, and how far it reaches
out vec4 result;

void main() {
  float fade = 1.0 - smoothstep(0.3, 0.95, distance(place, middle.xyz) / middle.w);
  result = vec4(shadow.rgb, shadow.a * fade);
}`;

const PLANE_VERTEX = `#version 300 es
layout(location = 0) in vec2 corner;
uniform mat4 toClip;
uniform vec3 centre;
uniform vec3 u;
uniform vec3 v;
uniform vec2 shift;
out vec2 local;
out vec2 grid;

void main() {
  local = corner;
  vec3 place = centre + corner.x * u + corner.y * v;
  grid = shift + corner * length(u);
  gl_Position = toClip * vec4(place, 1.0);
}`;

const PLANE_FRAGMENT = `#version 300 es
precision highp float;
in vec2 local;
in vec2 grid;
uniform float spacing;
uniform vec4 fill;
uniform vec4 line;
out vec4 result;

float lines(float every, float width) {
  vec2 g = grid / every;
  vec2 soft = fwidth(g);
  vec2 away = abs(fract(g - 0.5) - 0.5) / max(soft, vec2(1e-6));
  vec2 drawn = (1.0 - smoothstep(width - 0.5, width + 0.5, away)) * (1.0 - smoothstep(0.2, 0.5, soft));
  return max(drawn.x, drawn.y);
}

void main() {
  float fade = 1.0 - smoothstep(0.3, 0.95, length(local));
  float strength = max(0.5 * lines(spacing, 0.6), lines(5.0 * spacing, 0.75)) * line.a;
  float alpha = mix(fill.a, 1.0, strength);
  result = vec4(mix(fill.rgb, line.rgb, strength / max(alpha, 1e-3)), alpha * fade);
}`;

function compiled(gl, vertex, fragment) {
  const program = gl.createProgram();
  for (const [kind, source] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
    const shader = gl.createShader(kind);
    gl.shaderSource(shader, source);
    gl.compileShader(shader);
    gl.attachShader(program, shader);
  }
  gl.linkProgram(program);
  if (!gl.getProgramParameter(program, gl.LINK_STATUS) && !gl.isContextLost()) {
    const logs = gl.getAttachedShaders(program).map((shader) => gl.getShaderInfoLog(shader));
    throw new Error(`The graphics driver refused a program: ${[gl.getProgramInfoLog(program), ...logs].join(" ")}`);
  }
  const places = {};
  for (let i = 0; i < gl.getProgramParameter(program, gl.ACTIVE_UNIFORMS); i++) {
    const { name } = gl.getActiveUniform(program, i);
    places[name] = gl.getUniformLocation(program, name);
  }
  return { program, places };
}

const withShadow = (source) => source.replace("#version 300 es\n", "#version 300 es\n#define SHADOW\n");
