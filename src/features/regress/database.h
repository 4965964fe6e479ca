// SQLite behind two small classes. After the first trouble every later call does nothing, so a
// sequence is checked once at its end.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

struct sqlite3;
struct sqlite3_stmt;

namespace mbv {

class Statement;

/// Bytes to bind as a blob.
struct Blob {
  const std::string& bytes;
};

class Database {
 public:
  enum class Mode { kRead, kWrite, kCreate };

  /// Opens; waits up to `busy_s` for other writers at each later step. kRead takes a file in a
  /// folder that cannot be written, too, unless it has changes that were never joined with it.
  Database(const std::string& path, Mode mode, double busy_s = 60.0);

  [[nodiscard]] bool ok() const { return trouble_.empty(); }
  /// First thing that went wrong, with file and SQLite's reason; "" if nothing.
  [[nodiscard]] const std::string& trouble() const { return trouble_; }
  /// The trouble is another program's lock, which it will release.
  [[nodiscard]] bool locked() const { return locked_; }

  /// Runs statements without results.
  void Run(const std::string& sql);
  [[nodiscard]] long last_id() const;

 private:
  friend class Statement;
  void Open(const std::string& name, int flags, double busy_s);
  [[nodiscard]] bool CanRead();
  void Fail();

  struct Closer {
    void operator()(sqlite3* db) const;
  };
  std::string path_, trouble_;
  bool locked_ = false;
  std::unique_ptr<sqlite3, Closer> db_;
};

/// One prepared statement; parameters are bound in order by Bind(), which starts it anew.
class Statement {
 public:
  Statement(Database* database, const std::string& sql);
  ~Statement();
  Statement(const Statement&) = delete;
  Statement& operator=(const Statement&) = delete;

  template <typename... Values>
  Statement& Bind(const Values&... values) {
    Reset();
    (BindNext(values), ...);
    return *this;
  }
  /// Moves to the next row; false at the end or after trouble.
  [[nodiscard]] bool Step();
  /// Steps a statement that gives no rows.
  void Execute() { (void)Step(); }

  [[nodiscard]] long Integer(int column) const;
  [[nodiscard]] double Real(int column) const;       ///< NaN for null
  [[nodiscard]] std::string Text(int column) const;  ///< or the bytes of a blob

 private:
  void Reset();
  void BindNext(long value);
  void BindNext(int value) { BindNext(static_cast<long>(value)); }
  void BindNext(bool value) { BindNext(static_cast<long>(value)); }
  void BindNext(double value);  ///< NaN and infinity become null
  void BindNext(const std::optional<double>& value);
  void BindNext(const std::string& value);
  void BindNext(const char* value) { BindNext(std::string(value)); }
  void BindNext(const Blob& value);
  void BindNext(const std::vector<double>& values) {
    for (const double value : values) BindNext(value);
  }

  Database* database_;
  sqlite3_stmt* statement_ = nullptr;
  int next_ = 1;
};

}  // namespace mbv
