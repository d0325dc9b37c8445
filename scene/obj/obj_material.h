// MTL materials and their images to plain data. Private to the OBJ loader.
#pragma once

#include "scene/files/load_options.h"
#include "scene/obj/obj_parser.h"
#include "scene/scene.h"

namespace lumel {

/// Fills scene.materials (one per MTL material, then a default one) and scene.images. A separate map_d is combined
/// with map_Kd into one RGBA image (PNG). Missing images and grey bump maps are warnings, paths that leave the
/// folder errors.
Expected<void> loadObjMaterials(const ObjFile& file, const std::string& name, const std::filesystem::path& folder,
                                const LoadOptions& options, Scene& scene);

}  // namespace lumel
