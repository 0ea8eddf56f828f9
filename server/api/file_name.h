#pragma once

#include <string>
#include <string_view>

namespace creased {

/// A safe file name: the last component of the path, in valid UTF-8, without control characters, and not too long.
std::string clean_file_name(std::string_view name);

/// Content-Disposition [RFC 6266] of a download: the upload's name, what part of the result it is, and the extension,
/// as in noisy-smooth.obj, so that it does not take the place of the upload. In ASCII, and also in UTF-8 when ASCII
/// cannot represent it. `fallback` is used when there is no name.
std::string attachment(const std::string& upload_name, const std::string& fallback, std::string_view part,
                       std::string_view extension);

}  // namespace creased
