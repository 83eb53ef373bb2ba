#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <vector>

#include "visual_localization/map/training_map.h"
#include "visual_localization/parameters/parameters.h"

namespace visual_localization::map_schema {

/// The header as rows of the table `meta`, without the checksum. Of a mask they hold the checksum of its bits, of the
/// table of landmarks the number of its rows: to count them all of it would have to be read.
ParameterValues toMeta(const MapHeader& header, std::size_t geometry_count);
/// Removes from `meta` how many images of a map of this version have a geometry, and returns it. Throws
/// std::runtime_error when it is missing or not in [0, kMaxImages].
std::size_t takeGeometryCount(ParameterValues& meta, int version);
/// Masks as they are stored, by the number of their session.
using MaskBits = std::map<std::int64_t, std::vector<std::uint8_t>>;
/// Inverse of toMeta() for a map of this version, but for what takeGeometryCount() takes. Throws std::runtime_error
/// when a value or a mask is missing, unknown, of the wrong type or out of range, and when a mask does not agree with
/// its checksum.
MapHeader toHeader(ParameterValues meta, int version, const MaskBits& masks);

}  // namespace visual_localization::map_schema
