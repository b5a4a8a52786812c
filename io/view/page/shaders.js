// SPDX-License-Identifier: BSD-3-Clause
"use strict";
// The programs of the graphics card (GLSL ES 3.0). All spheres, bonds, walls and lines share the uniforms at the top.
const UNIFORMS = `#version 300 es
precision highp float;
uniform mat4 view, projection;
uniform vec2 half_size;     // of the picture [pixels]
uniform vec3 palette[8];
uniform vec2 range;         // the values at the ends of the colours
uniform bool categories;    // values are numbers of species
uniform bool flat_;         // two dimensions: discs
uniform vec4 colour;        // of lines, bonds and walls
uniform float spacing;      // of the hatching of walls [length]
`;
// A sphere is a point, or where it is too large for that a square of two triangles, just large enough for its picture; the
// fragment shader intersects the line of sight with the sphere.
const SPHERE_VERTEX = UNIFORMS + `
layout(location = 0) in vec4 sphere;
layout(location = 1) in float value;
uniform bool squares;
flat out vec3 centre;
flat out float r, shade;
vec2 extent(float x) {      // of the picture of the sphere along one axis: its middle and half its width, as slopes
  float z = -centre.z, below = max(z * z - r * r, 1e-3 * r * r), half_width = r * sqrt(max(x * x + z * z - r * r, 0.0));
  return vec2(x * z, half_width) / below;
}
void main() {
  centre = (view * vec4(sphere.xyz, 1.0)).xyz;
  r = sphere.w;
  shade = value;
  vec2 x = extent(centre.x), y = extent(centre.y), zoom = vec2(projection[0].x, projection[1].y);
  vec2 corner = vec2(gl_VertexID & 1, gl_VertexID >> 1) * 2.0 - 1.0, middle = vec2(x.x, y.x), half_width = vec2(x.y, y.y);
  gl_Position = vec4(zoom * (squares ? middle + corner * half_width : middle), 0.0, 1.0);
  gl_PointSize = 2.0 * max(half_width.x, half_width.y) * zoom.x * half_size.x + 1.0;
}`;
const SPHERE_FRAGMENT = UNIFORMS + `
flat in vec3 centre;
flat in float r, shade;
out vec4 pixel;
void main() {
  vec3 along = normalize(vec3((gl_FragCoord.xy / half_size - 1.0) / vec2(projection[0].x, projection[1].y), -1.0));
  float t = dot(along, centre);
  vec3 nearest = t * along - centre;
  float h2 = r * r - dot(nearest, nearest);
  if (h2 < 0.0) discard;
  vec3 hit = (t - sqrt(h2)) * along, normal = (hit - centre) / r;
  gl_FragDepth = 0.5 - 0.5 * (projection[2].z * hit.z + projection[3].z) / hit.z;
  float x = 7.0 * clamp((shade - range.x) / max(range.y - range.x, 1e-30), 0.0, 1.0);
  vec3 base = shade < -1e29 ? vec3(1.0)
      : categories ? palette[int(mod(shade, 8.0))] : mix(palette[int(x)], palette[min(int(x) + 1, 7)], fract(x));
  float light = max(dot(normal, normalize(vec3(-0.3, 0.5, 0.8))), 0.0);
  pixel = vec4(flat_ ? base * smoothstep(0.0, 0.45, sqrt(h2) / r) : base * (0.35 + 0.65 * light) + 0.25 * pow(light, 40.0), 1.0);
}`;
// A bond is a strip between two points that faces the camera, shaded like a cylinder.
const BOND_VERTEX = UNIFORMS + `
layout(location = 0) in vec3 start;
layout(location = 1) in vec3 end;
layout(location = 2) in float thickness;
out float across;
void main() {
  vec3 a = (view * vec4(start, 1.0)).xyz, b = (view * vec4(end, 1.0)).xyz, middle = gl_VertexID < 2 ? a : b;
  vec3 side = cross(b - a, middle);
  across = (gl_VertexID & 1) == 0 ? -1.0 : 1.0;
  float pixel = -middle.z / (projection[0].x * half_size.x);   // no strip is narrower than a pixel
  gl_Position = projection * vec4(middle + across * max(thickness, 0.6 * pixel) * side / max(length(side), 1e-30), 1.0);
}`;
const BOND_FRAGMENT = UNIFORMS + `
in float across;
out vec4 pixel;
void main() { pixel = vec4(colour.rgb * (0.4 + 0.6 * sqrt(max(0.0, 1.0 - across * across))), 1.0); }`;
const LINE_VERTEX = UNIFORMS + `
layout(location = 0) in vec3 position;
out vec3 place;
void main() {
  place = position;
  gl_Position = projection * view * vec4(position, 1.0);
}`;
const LINE_FRAGMENT = UNIFORMS + `
out vec4 pixel;
void main() { pixel = colour; }`;
const WALL_FRAGMENT = UNIFORMS + `
in vec3 place;
out vec4 pixel;
void main() {
  float stripe = fract((place.x + place.y + place.z) / spacing);
  pixel = vec4(colour.rgb, colour.a * (stripe < 0.2 ? 1.0 : 0.3));
}`;
