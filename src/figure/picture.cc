// Files of drawings.
#include <cairo-pdf.h>
#include <cairo-svg.h>

#include <cctype>
#include <cmath>
#include <cstdint>
#include <map>

#include "core/demand.h"
#include "figure/canvas.h"
#include "image/png.h"
#include "text/cairo_handles.h"

namespace mbv {
namespace {

using internal::Handle;

constexpr double kPerInch = 72.0;  // points

cairo_status_t Append(void* text, const unsigned char* bytes, unsigned count) {
  static_cast<std::string*>(text)->append(reinterpret_cast<const char*>(bytes), count);
  return CAIRO_STATUS_SUCCESS;
}

// Cairo counts its surfaces through the whole program: "image12" in one drawing is "image19" in
// the next. Counted anew in the order in which they are named.
std::string Renumbered(const std::string& svg) {
  std::string out;
  std::map<std::string, std::string> names;
  size_t from = 0;
  for (size_t at = 0; at < svg.size(); ++at) {
    for (const std::string word :
         {"\"image", "#image", "\"surface", "#surface", "\"clip", "#clip"}) {
      if (svg.compare(at, word.size(), word) != 0) continue;
      size_t end = at + word.size();
      while (end < svg.size() && std::isdigit(static_cast<unsigned char>(svg[end])) != 0) ++end;
      if (end == at + word.size()) continue;
      const std::string name = svg.substr(at + 1, end - at - 1);
      const auto known = names.emplace(name, word.substr(1) + std::to_string(names.size())).first;
      out += svg.substr(from, at + 1 - from) + known->second;
      from = end;
    }
  }
  return out + svg.substr(from);
}

std::string PngOf(cairo_surface_t* surface) {
  cairo_surface_flush(surface);
  Picture picture{.width = cairo_image_surface_get_width(surface),
                  .height = cairo_image_surface_get_height(surface)};
  const unsigned char* row = cairo_image_surface_get_data(surface);
  for (int y = 0; y < picture.height; ++y, row += cairo_image_surface_get_stride(surface)) {
    for (int x = 0; x < picture.width; ++x) {
      const std::uint32_t pixel = reinterpret_cast<const std::uint32_t*>(row)[x];
      for (const int shift : {16, 8, 0}) {
        picture.rgb.push_back(static_cast<std::uint8_t>(pixel >> shift));
      }
    }
  }
  return EncodePng(picture);
}

std::string DrawVector(bool pdf, const FigureStyle& style, double width, double height,
                       const std::string& title, const std::function<void(const Canvas&)>& draw) {
  std::string bytes;
  const Handle<cairo_surface_t> surface(
      pdf ? cairo_pdf_surface_create_for_stream(Append, &bytes, width, height)
          : cairo_svg_surface_create_for_stream(Append, &bytes, width, height));
  if (pdf) {
    cairo_pdf_surface_set_metadata(surface.get(), CAIRO_PDF_METADATA_TITLE, title.c_str());
    // No date: the bytes follow from the drawing alone.
    cairo_pdf_surface_set_metadata(surface.get(), CAIRO_PDF_METADATA_CREATE_DATE, "");
  }
  const Handle<cairo_t> cairo(cairo_create(surface.get()));
  draw(Canvas(style, cairo.get()));
  cairo_surface_finish(surface.get());
  const cairo_status_t status = cairo_surface_status(surface.get());
  MBV_DEMAND(status == CAIRO_STATUS_SUCCESS, cairo_status_to_string(status));
  return pdf ? bytes : Renumbered(bytes);
}

std::string DrawPixels(const FigureStyle& style, double width, double height,
                       const std::function<void(const Canvas&)>& draw) {
  const double scale = style.dpi / kPerInch;
  const Handle<cairo_surface_t> surface(
      cairo_image_surface_create(CAIRO_FORMAT_RGB24, static_cast<int>(std::ceil(width * scale)),
                                 static_cast<int>(std::ceil(height * scale))));
  const Handle<cairo_t> cairo(cairo_create(surface.get()));
  MBV_DEMAND(cairo_status(cairo.get()) == CAIRO_STATUS_SUCCESS, width);
  cairo_set_source_rgb(cairo.get(), 1, 1, 1);
  cairo_paint(cairo.get());
  cairo_scale(cairo.get(), scale, scale);
  draw(Canvas(style, cairo.get()));
  return PngOf(surface.get());
}

}  // namespace

std::string DrawPicture(PictureFormat format, const FigureStyle& style, double width, double height,
                        const std::string& title, const std::function<void(const Canvas&)>& draw) {
  if (format == PictureFormat::kPng) return DrawPixels(style, width, height, draw);
  return DrawVector(format == PictureFormat::kPdf, style, width, height, title, draw);
}

}  // namespace mbv
