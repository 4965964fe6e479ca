// index.html: one self-contained page of a regression run.

#include <fmt/format.h>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "base/json_text.h"
#include "base/markup.h"
#include "base/png.h"
#include "base/sha256.h"
#include "features/regress/summaries.h"
#include "features/regress/trouble_text.h"
#include "report/page.h"

namespace mbv {
namespace {

// For the filter and colour: 0 bad, 1 warn, 2 good.
int KindOf(const CaseResult& result) { return result.failed() ? 0 : result.drifts.empty() ? 2 : 1; }

constexpr double kLowestValue = 1e-17;  // what is smaller is drawn there: below any round-off
constexpr size_t kRunsShown = 12;       // of a course

constexpr size_t kChecksOfACase = 5, kChecksOfARow = 1;
constexpr size_t kCasesInABox = 30, kMostInABox = 200;

// Where a case's row is: a name without anything that an address would encode.
std::string RowId(const CaseResult& result) {
  std::string id = EncodeLink(result.key);
  std::replace(id.begin(), id.end(), '%', '~');
  return "case/" + id;
}

// The table as the page's script draws it (rows.js): texts that occur again by number, a short
// array for each scenario.
class TableData {
 public:
  void Add(const CaseResult& result) {
    const auto* key = KeyMetric(result);
    Json course = Json::array();
    if (key != nullptr) {
      const size_t first = result.course.size() - std::min(kRunsShown, result.course.size());
      for (size_t i = first; i < result.course.size(); ++i) {
        const double level = std::log10(std::max(result.course[i], kLowestValue));
        if (std::isfinite(level)) course.push_back(Rounded(level, "{:.1f}"));
      }
    }
    Json open = Json::array();
    for (const Unmeasured& item : result.not_compared)
      open.push_back(Text(item.what + ": " + item.why));
    rows_.push_back(
        {result.key, Text(result.description), KindOf(result),
         result.expected.verdict == "agree" ? 0 : 1, Text(WordOf(result)),
         key == nullptr ? Json() : Rounded(key->second.value, "{:.3g}"),
         key == nullptr || !key->second.limit ? Json() : Rounded(*key->second.limit, "{:.2g}"),
         std::move(course), Notes(result), std::move(open), Rounded(result.cost.wall_s, "{:.1f}"),
         Rounded(result.cost.cpu_s, "{:.1f}"), Rounded(result.cost.peak_mib(), "{:.0f}"),
         (result.has_report ? 1 : 0) + (result.has_folder ? 2 : 0)});
  }

  [[nodiscard]] std::string Write(const std::map<std::string, std::string>& pictures) && {
    return EscapeScript(DumpLine(
        Json{{"texts", std::move(texts_)}, {"pictures", pictures}, {"rows", std::move(rows_)}}));
  }

 private:
  using Json = nlohmann::ordered_json;

  // As many digits as are shown.
  static Json Rounded(double value, const char* digits) {
    return std::isfinite(value) ? Json(std::stod(fmt::format(fmt::runtime(digits), value)))
                                : Json();
  }

  size_t Text(const std::string& text) {
    const auto [at, is_new] = numbers_.try_emplace(text, texts_.size());
    if (is_new) texts_.push_back(text);
    return at->second;
  }

  // What a reader should know beyond the numbers.
  Json Notes(const CaseResult& result) {
    Json notes = Json::array();
    const auto add = [&](const char* kind, const std::string& text) {
      notes.push_back({kind, Text(text)});
    };
    if (result.failed()) {
      add("bad", result.reason);
      for (const std::string& text : FailureTexts(result, kChecksOfARow)) add("li", text);
    }
    if (!result.drifts.empty()) add("warn", DriftLine(result));
    if (!result.failed() && !result.verified) add("soft", result.reason);
    for (const std::string& caveat : result.caveats) add("warn", "caveat: " + caveat);
    if (!result.log_tail.empty()) add("log", result.log_tail);
    return notes;
  }

  Json texts_ = Json::array(), rows_ = Json::array();
  std::map<std::string, size_t> numbers_;
};

std::string ListOf(const std::vector<std::string>& texts) {
  std::string html;
  for (const std::string& text : texts) html += "<li>" + EscapeMarkup(text) + "</li>";
  return html.empty() ? "" : "<ul>" + html + "</ul>";
}

// A list with a title; what is beyond kCasesInABox is folded away, beyond kMostInABox left to the
// table.
std::string Framed(const char* kind, const char* id, const std::string& title,
                   const std::vector<std::string>& items) {
  if (items.empty()) return "";
  const size_t shown = std::min(items.size(), kMostInABox);
  std::string html = fmt::format(
      "<section class=\"box {0}\" aria-labelledby=\"{1}\"><h2 id=\"{1}\">{2} {3}</h2>\n"
      "<ul>",
      kind, id, items.size(), title);
  for (size_t i = 0; i < shown; ++i) {
    if (i == kCasesInABox) {
      html += fmt::format("</ul><details><summary>{} more</summary><ul>", items.size() - i);
    }
    html += "<li>" + items[i] + "</li>\n";
  }
  if (shown < items.size()) {
    html += fmt::format("<li>{} more in the table below</li>\n", items.size() - shown);
  }
  return html + (items.size() > kCasesInABox ? "</ul></details>" : "</ul>") + "</section>\n";
}

// What went wrong, what is gone, what drifted: each in one place, the worst first.
std::string Boxes(const RegressReport& report, const std::vector<const CaseResult*>& cases) {
  std::vector<std::string> failed, missing, drifted;
  for (size_t i = 0; i < cases.size(); ++i) {
    const CaseResult* result = cases[i];
    const std::string page = i < kCasesOnAPage ? "" : IndexPageName(i / kCasesOnAPage);
    const std::string link = fmt::format("<a href=\"{}#{}\">{}</a>", page,
                                         EscapeMarkup(RowId(*result)), EscapeMarkup(result->key));
    if (result->failed()) {
      failed.push_back(fmt::format("{} <span class=\"word bad\">{}</span>: {}{}", link,
                                   EscapeMarkup(WordOf(*result)), EscapeMarkup(result->reason),
                                   ListOf(FailureTexts(*result, kChecksOfACase))));
    } else if (!result->drifts.empty()) {
      drifted.push_back(link + ": " + EscapeMarkup(DriftLine(*result)));
    }
  }
  for (const MissingCase& item : report.missing) {
    missing.push_back(
        fmt::format("<b>{}</b>: {}", EscapeMarkup(item.key), EscapeMarkup(MissingText(item))));
  }
  return Framed("bad", "failed", "not as expected", failed) +
         Framed(report.fail_on_missing ? "bad" : "warn", "missing", "missing", missing) +
         Framed("warn", "drifted", "drifted", drifted);
}

std::string Head(const RegressReport& report) {
  const int code = ExitCodeOf(report);
  const RunInfo& run = report.run;
  std::string text =
      fmt::format("<h1>Regression: <span class=\"{}\">{}</span></h1>\n<p class=\"counts\">{}</p>\n",
                  code == 0 ? "good" : "bad", code == 0 ? "all as expected" : "not as expected",
                  CountsText(CountCases(report)));
  text += fmt::format(
      "<p class=\"soft\">{}{}{}{}, started {}, {:.1f} s with {} worker{}</p>\n",
      run.id == 0 ? "" : fmt::format("run {}, ", run.id),
      run.label.empty() ? "" : EscapeMarkup(run.label) + ", ", EscapeMarkup(run.program),
      run.shard.empty() ? "" : ", shard " + EscapeMarkup(run.shard), EscapeMarkup(run.started_utc),
      run.wall_s, run.jobs, run.jobs == 1 ? "" : "s");
  for (const std::string& note : report.notes) {
    text += "<p class=\"warn\">" + EscapeMarkup(note) + "</p>\n";
  }
  return text;
}

// Links to all pages, where there are several.
std::string PageLinks(size_t page, size_t pages) {
  if (pages < 2) return "";
  std::string html =
      "<nav class=\"soft\" aria-label=\"pages\">Each page has its own table, the "
      "worst scenarios on the first. Page";
  for (size_t k = 0; k < pages; ++k) {
    html += k == page ? fmt::format(" <b aria-current=\"page\">{}</b>", k + 1)
                      : fmt::format(" <a href=\"{}\">{}</a>", IndexPageName(k), k + 1);
  }
  return html + "</nav>\n";
}

}  // namespace

std::string IndexPageName(size_t page) {
  return page == 0 ? "index.html" : fmt::format("index-{}.html", page + 1);
}

std::vector<std::string> ToIndexPages(const RegressReport& report,
                                      const std::map<std::string, std::string>& pictures) {
  const std::vector<const CaseResult*> cases = BySeverity(report);
  const size_t count = std::max<size_t>(1, (cases.size() + kCasesOnAPage - 1) / kCasesOnAPage);
  const std::string title =
      fmt::format("mbverify regression {}: {}", EscapeMarkup(report.run.started_utc),
                  ExitCodeOf(report) == 0 ? "all as expected" : "not as expected");
  std::vector<std::string> pages;
  for (size_t page = 0; page < count; ++page) {
    TableData table;
    std::map<std::string, std::string> shown;
    const size_t end = std::min(cases.size(), (page + 1) * kCasesOnAPage);
    for (size_t i = page * kCasesOnAPage; i < end; ++i) {
      table.Add(*cases[i]);
      const std::string model = cases[i]->key.substr(0, cases[i]->key.find('/'));
      if (const auto picture = pictures.find(model); picture != pictures.end()) {
        shown.insert(*picture);
      }
    }
    pages.push_back(FillPage(IndexPage(), {{"style_hash", CspHash(IndexStyle())},
                                           {"script_hash", CspHash(IndexScript())},
                                           {"title", title},
                                           {"style", IndexStyle()},
                                           {"head", Head(report) + PageLinks(page, count)},
                                           {"boxes", page == 0 ? Boxes(report, cases) : ""},
                                           {"data", std::move(table).Write(shown)},
                                           {"script", IndexScript()}}));
  }
  return pages;
}

// Thumbnails: PNG → smaller PNG → data URI.

namespace {

constexpr std::uint64_t kMostPixels = 1ULL << 26;  // 8192 × 8192, the largest that is drawn

// Without the caption bar, which is white under a rule across the whole picture: its words would be
// too small to read.
Picture WithoutCaption(Picture image) {
  const auto pixel = [&](int x, int y) {
    return image.rgb.data() +
           3 * (static_cast<size_t>(y) * static_cast<size_t>(image.width) + static_cast<size_t>(x));
  };
  const auto is_like = [&](int y, const std::uint8_t* color) {
    for (int x = 0; x < image.width; ++x) {
      if (!std::equal(color, color + 3, pixel(x, y))) return false;
    }
    return true;
  };
  constexpr std::uint8_t kWhite[] = {255, 255, 255};
  for (int y = image.height - 2; y > image.height / 2; --y) {
    if (!is_like(y + 1, kWhite) || is_like(y, kWhite) || !is_like(y, pixel(0, y))) continue;
    image.height = y;
    image.rgb.resize(3 * static_cast<size_t>(image.width) * static_cast<size_t>(image.height));
    break;
  }
  return image;
}

// Mean of the pixels under each new one, in 32 levels per colour: small files.
Picture Shrink(const Picture& image, int width) {
  // a · b / c without overflow
  const auto share = [](int a, int b, int c) { return static_cast<int>(std::int64_t{a} * b / c); };
  Picture small;
  small.width = std::min(width, image.width);
  small.height = std::max(1, share(image.height, small.width, image.width));
  for (int y = 0; y < small.height; ++y) {
    const int y0 = share(y, image.height, small.height);
    const int y1 = std::max(y0 + 1, share(y + 1, image.height, small.height));
    for (int x = 0; x < small.width; ++x) {
      const int x0 = share(x, image.width, small.width);
      const int x1 = std::max(x0 + 1, share(x + 1, image.width, small.width));
      for (size_t c = 0; c < 3; ++c) {
        unsigned sum = 0;
        for (int v = y0; v < y1; ++v) {
          for (int u = x0; u < x1; ++u) {
            sum += image.rgb[3 * (static_cast<size_t>(v) * static_cast<size_t>(image.width) +
                                  static_cast<size_t>(u)) +
                             c];
          }
        }
        const unsigned mean = sum / static_cast<unsigned>((y1 - y0) * (x1 - x0));
        small.rgb.push_back(static_cast<std::uint8_t>((mean >> 3) * 255 / 31));
      }
    }
  }
  return small;
}

}  // namespace

std::string ThumbnailUri(const std::string& png, int width_px) {
  Picture picture;
  if (width_px < 1 || !DecodePng(png, kMostPixels, &picture)) return "";
  return "data:image/png;base64," +
         EncodeBase64(EncodePng(Shrink(WithoutCaption(std::move(picture)), width_px)));
}

}  // namespace mbv
