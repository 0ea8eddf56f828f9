#pragma once

#include <string>
#include <string_view>

namespace creased {

/// A name as an upload may carry it: the last component of a path, UTF-8, without control characters, short.
std::string clean_file_name(std::string_view name);

/// Content-Disposition [RFC 6266] of a download: the upload's name with another extension, in ASCII and, where that
/// loses something, in UTF-8.
std::string attachment(const std::string& upload_name, const std::string& otherwise, const std::string& extension);

}  // namespace creased
