#include "model_file/yaml/parsed_documents.h"

#include <algorithm>

namespace mbv {
namespace {

thread_local ParsedDocuments* parsed = nullptr;

}  // namespace

// The outermost one keeps the documents, so that they outlive each part of a command.
ParsedDocuments::ParsedDocuments() : outer_(parsed) {
  if (outer_ == nullptr) parsed = this;
}

ParsedDocuments::~ParsedDocuments() {
  if (outer_ == nullptr) parsed = nullptr;
}

YamlNodePtr ParsedDocuments::Find(const std::string& text) {
  if (parsed == nullptr) return nullptr;
  auto& kept = parsed->kept_;
  const auto found = std::find_if(kept.begin(), kept.end(),
                                  [&](const auto& document) { return document.first == text; });
  if (found == kept.end()) return nullptr;
  kept.splice(kept.begin(), kept, found);
  return found->second;
}

void ParsedDocuments::Keep(const std::string& text, const YamlNodePtr& root) {
  if (parsed == nullptr) return;
  parsed->kept_.emplace_front(text, root);
  if (parsed->kept_.size() > kMostDocuments) parsed->kept_.pop_back();
}

}  // namespace mbv
