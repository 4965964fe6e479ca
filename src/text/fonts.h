// The faces that journals ask for, else those of the same metrics; then Chinese (fonts-noto-cjk).
#pragma once

namespace mbv {

inline constexpr const char* kSerif =
    "Times New Roman, Liberation Serif, TeX Gyre Termes, Noto Serif CJK SC, serif";
inline constexpr const char* kSans =
    "Arial, Liberation Sans, TeX Gyre Heros, Noto Sans CJK SC, sans-serif";

}  // namespace mbv
