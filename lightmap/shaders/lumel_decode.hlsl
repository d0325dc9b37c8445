// The light on a normal from the maps of a bake by Lumel: irradiance / pi, so that colour = albedo * light + emission.
// n: the normal map's 2 * texel - 1 (green up), normalised, in the tangent space of scene.glb; (0, 0, 1) without one.
// Arguments before it are the encoding's maps in the order that bake.json names, as looked up, without conversion.

float lumelLuminance(float3 c) { return dot(c, float3(0.2126, 0.7152, 0.0722)); }

float3 lumelUnit(float3 v) {
  float square = dot(v, v);
  return square > float(0.0) ? v * rsqrt(square) : float3(0.0, 0.0, 1.0);
}

// Projections raw, flat and fit.
float3 lumelDecodeRnm(float3 rnm0, float3 rnm1, float3 rnm2, float3 n) {
  float3 w = max(float3(dot(n, float3(0.8164966, 0.0, 0.5773503)), dot(n, float3(-0.4082483, 0.7071068, 0.5773503)),
                    dot(n, float3(-0.4082483, -0.7071068, 0.5773503))),
               float3(0.0, 0.0, 0.0));
  w = w * w;
  return (w.x * rnm0 + w.y * rnm1 + w.z * rnm2) / (w.x + w.y + w.z);
}

// Projection signed.
float3 lumelDecodeRnmSigned(float3 rnm0, float3 rnm1, float3 rnm2, float3 n) {
  float3 w = max(float3(dot(n, float3(0.8164966, 0.0, 0.5773503)), dot(n, float3(-0.4082483, 0.7071068, 0.5773503)),
                    dot(n, float3(-0.4082483, -0.7071068, 0.5773503))),
               float3(0.0, 0.0, 0.0));
  return max(w.x * rnm0 + w.y * rnm1 + w.z * rnm2, float3(0.0, 0.0, 0.0));
}

float3 lumelDecodeSh1(float3 l0, float3 lx, float3 ly, float3 lz, float3 n) {
  return max(l0 + n.x * lx + n.y * ly + n.z * lz, float3(0.0, 0.0, 0.0));
}

float3 lumelDecodeH4(float3 h1, float3 h2, float3 h3, float3 h4, float3 n) {
  float k1 = float(0.398942280);
  float k = float(0.690988299);
  return max(k1 * h1 + k * (n.y * h2 + (n.z + n.z - float(1.0)) * h3 + n.x * h4), float3(0.0, 0.0, 0.0));
}

float3 lumelDecodeZh3(float3 l0, float3 lx, float3 ly, float3 lz, float3 zonal, float3 n) {
  float along = dot(n, lumelUnit(float3(lumelLuminance(lx), lumelLuminance(ly), lumelLuminance(lz))));
  float legendre = float(1.5) * along * along - float(0.5);
  return max(l0 + n.x * lx + n.y * ly + n.z * lz + legendre * zonal, float3(0.0, 0.0, 0.0));
}

float3 lumelDecodeAhd(float3 ambient, float3 light, float3 direction, float3 n) {
  float3 d = lumelUnit(direction + direction - float3(1.0, 1.0, 1.0));
  return ambient + light * max(dot(n, d), float(0.0));
}

float3 lumelDecodeDominant(float3 flatLight, float3 direction, float3 n) {
  float halfCosine = dot(n, direction - float3(0.5, 0.5, 0.5)) + float(0.5);
  return flatLight * max(halfCosine / max(direction.z, float(0.0001)), float(0.0));
}
