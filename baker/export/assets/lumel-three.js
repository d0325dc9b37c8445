// Loads what `lumel export --for three` wrote: the scene with its lightmaps, page by page.
//
//   import { loadLumel } from './lumel-three.js';
//   const { scene } = await loadLumel('level/', { gltfLoader, ktx2Loader, mode: 'rnm' });
//
// gltfLoader and ktx2Loader are three's GLTFLoader and KTX2Loader (after detectSupport). mode: 'flat' (one map), or
// 'rnm' where the export has these maps: then normal maps are lit from where the light came. Texels hold irradiance / pi,
// three wants irradiance, hence the intensity of pi. Textures are stored from the top down and UVs run down, so nothing
// is flipped.
import { LinearFilter, NoColorSpace, ShaderChunk } from 'three';

const MAP_NAMES = { flat: ['flat'], rnm: ['rnm0', 'rnm1', 'rnm2'] };

// Radiosity normal mapping, squared weights, or plain ones for maps of signed projection: see "decodeFormula" in
// export.json. The normal map's texel is read again,
// since three has turned it into view space by then.
const RNM_PARS = /* glsl */ `
uniform sampler2D lumelRnm1;
uniform sampler2D lumelRnm2;
vec3 lumelDecode( vec3 n, vec3 map0, vec3 map1, vec3 map2 ) {
  vec3 w = vec3( dot( n, vec3( 0.8164966, 0.0, 0.5773503 ) ), dot( n, vec3( -0.4082483, 0.7071068, 0.5773503 ) ),
                 dot( n, vec3( -0.4082483, -0.7071068, 0.5773503 ) ) );
  w = max( w, vec3( 0.0 ) );
  #ifdef LUMEL_SIGNED
    return max( w.x * map0 + w.y * map1 + w.z * map2, vec3( 0.0 ) );
  #else
    w *= w;
    return ( w.x * map0 + w.y * map1 + w.z * map2 ) / max( w.x + w.y + w.z, 1e-6 );
  #endif
}
`;
const RNM_TEXEL = /* glsl */ `
  vec3 lumelNormal = vec3( 0.0, 0.0, 1.0 );
  #ifdef USE_NORMALMAP_TANGENTSPACE
    lumelNormal = texture2D( normalMap, vNormalMapUv ).xyz * 2.0 - 1.0;
    lumelNormal.xy *= normalScale;
    lumelNormal = normalize( lumelNormal );
  #endif
  vec4 lightMapTexel = vec4( lumelDecode( lumelNormal, texture2D( lightMap, vLightMapUv ).rgb,
      texture2D( lumelRnm1, vLightMapUv ).rgb, texture2D( lumelRnm2, vLightMapUv ).rgb ), 1.0 );
`;

function useRnm(material, maps, isSigned) {
  material.onBeforeCompile = (shader) => {
    shader.uniforms.lumelRnm1 = { value: maps[1] };
    shader.uniforms.lumelRnm2 = { value: maps[2] };
    const lights = ShaderChunk.lights_fragment_maps.replace(
      /vec4 lightMapTexel = texture2D\( lightMap, vLightMapUv \);/, RNM_TEXEL);
    if (lights === ShaderChunk.lights_fragment_maps) throw new Error('lumel: this version of three samples lightmaps otherwise');
    shader.fragmentShader = shader.fragmentShader
      .replace('void main() {', (isSigned ? '#define LUMEL_SIGNED\n' : '') + RNM_PARS + 'void main() {')
      .replace('#include <lights_fragment_maps>', lights);
  };
  material.customProgramCacheKey = () => (isSigned ? 'lumel-rnm-signed' : 'lumel-rnm');
}

/** The textures of an object: those of its page, read through its rectangle. */
function placed(textures, { scale, offset }) {
  return textures.map((texture) => {
    const own = texture.clone(); // shares the image on the GPU
    own.channel = 1;
    own.repeat.set(scale[0], scale[1]);
    own.offset.set(offset[0], offset[1]);
    own.needsUpdate = true;
    return own;
  });
}

export async function loadLumel(folder, { gltfLoader, ktx2Loader, mode = 'flat' }) {
  const base = folder.endsWith('/') ? folder : folder + '/';
  const about = await (await fetch(base + 'export.json')).json();
  const names = MAP_NAMES[mode];
  if (!names) throw new Error(`lumel: mode ${mode} is neither flat nor rnm`);
  const pages = [];
  for (const map of about.maps) {
    const index = names.indexOf(map.map);
    if (index < 0) continue;
    const texture = await ktx2Loader.loadAsync(base + map.file);
    texture.colorSpace = NoColorSpace;
    texture.magFilter = LinearFilter;
    if (map.levels === 1) texture.minFilter = LinearFilter;
    (pages[map.page] ??= [])[index] = texture;
  }
  const gltf = await gltfLoader.loadAsync(base + 'scene.glb');
  const lit = [];
  gltf.scene.traverse((object) => {
    const place = object.userData.lumel ?? object.parent?.userData.lumel; // primitives are children of their node
    if (!object.isMesh || !(place?.page >= 0) || !object.geometry.attributes.uv1) return;
    const textures = pages[place.page];
    if (!textures || names.some((_, i) => !textures[i])) throw new Error(`lumel: the export has no ${mode} maps`);
    const maps = placed(textures, place);
    const material = object.material.clone();
    material.lightMap = maps[0];
    material.lightMapIntensity = Math.PI;
    if (mode === 'rnm') useRnm(material, maps, about.conventions.projection === 'signed');
    object.material = material;
    lit.push(object);
  });
  return { scene: gltf.scene, lit, about };
}
