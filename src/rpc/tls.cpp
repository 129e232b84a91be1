#include <fmt/format.h>

#include <openssl/err.h>
#include <openssl/ssl.h>
#include <openssl/x509v3.h>

#include <algorithm>
#include <array>
#include <memory>
#include <system_error>
#include <vector>

#include "sentree/rpc/certificates.h"
#include "sentree/rpc/stream.h"

namespace sentree::rpc {
namespace {

std::string last_error() {
  const unsigned long code = ::ERR_get_error();
  ::ERR_clear_error();
  if (ERR_SYSTEM_ERROR(code)) return std::generic_category().message(ERR_GET_REASON(code));
  const char* reason = ::ERR_reason_error_string(code);
  return reason != nullptr ? reason : "unknown reason";
}

// Since TLS 1.3 a peer says what it thinks of our certificate only after the handshake, in place of its first data
// (RFC 8446, 4.4.2.4 and 6.2).
bool certificate_is_refused(unsigned long code) {
  if (ERR_GET_LIB(code) != ERR_LIB_SSL) return false;
  switch (ERR_GET_REASON(code)) {
    case SSL_R_SSLV3_ALERT_BAD_CERTIFICATE:
    case SSL_R_SSLV3_ALERT_CERTIFICATE_EXPIRED:
    case SSL_R_SSLV3_ALERT_CERTIFICATE_REVOKED:
    case SSL_R_SSLV3_ALERT_CERTIFICATE_UNKNOWN:
    case SSL_R_SSLV3_ALERT_UNSUPPORTED_CERTIFICATE:
    case SSL_R_TLSV1_ALERT_UNKNOWN_CA:
    case SSL_R_TLSV13_ALERT_CERTIFICATE_REQUIRED: return true;
    default: return false;
  }
}

}  // namespace

class TlsContext {
 public:
  explicit TlsContext(bool server)
      : server_(server), context_(::SSL_CTX_new(server ? ::TLS_server_method() : ::TLS_client_method())) {}
  TlsContext(const TlsContext&) = delete;
  TlsContext& operator=(const TlsContext&) = delete;
  ~TlsContext() { ::SSL_CTX_free(context_); }

  [[nodiscard]] bool server() const { return server_; }
  [[nodiscard]] SSL_CTX* get() const { return context_; }

 private:
  bool server_;
  SSL_CTX* context_;
};

namespace {

// TLS between two memory buffers, so that every wait is the plain stream's, with its deadline.
class TlsStream final : public Stream {
 public:
  TlsStream(std::unique_ptr<Stream> plain, std::shared_ptr<const TlsContext> context)
      : plain_(std::move(plain)), context_(std::move(context)), ssl_(::SSL_new(context_->get())) {
    BIO* in = ::BIO_new(::BIO_s_mem());
    BIO* out = ::BIO_new(::BIO_s_mem());
    BIO_set_mem_eof_return(in, -1);
    BIO_set_mem_eof_return(out, -1);
    ::SSL_set_bio(ssl_, in, out);
    if (context_->server())
      ::SSL_set_accept_state(ssl_);
    else
      ::SSL_set_connect_state(ssl_);
  }
  TlsStream(const TlsStream&) = delete;
  TlsStream& operator=(const TlsStream&) = delete;
  ~TlsStream() override { ::SSL_free(ssl_); }

  StreamStatus handshake(const std::string& host, Deadline deadline) {
    if (!context_->server()) {
      X509_VERIFY_PARAM* check = ::SSL_get0_param(ssl_);
      if (::X509_VERIFY_PARAM_set1_ip_asc(check, host.c_str()) != 1) {
        ::SSL_set1_host(ssl_, host.c_str());
        ::SSL_set_tlsext_host_name(ssl_, host.c_str());
      }
      ::ERR_clear_error();
    }
    while (true) {
      const int done = ::SSL_do_handshake(ssl_);
      const int error = ::SSL_get_error(ssl_, done);
      if (const auto status = flush(deadline); status != StreamStatus::kOk) return status;
      if (done == 1) return StreamStatus::kOk;
      if (error != SSL_ERROR_WANT_READ) {
        const long verified = ::SSL_get_verify_result(ssl_);
        why_ = verified != X509_V_OK ? std::string("certificate refused: ") + ::X509_verify_cert_error_string(verified)
                                     : last_error();
        return StreamStatus::kFailed;
      }
      if (const auto status = fetch(deadline); status != StreamStatus::kOk) return status;
    }
  }

  Received receive(std::uint8_t* out, std::size_t size, Deadline deadline) override {
    while (true) {
      std::size_t got = 0;
      if (::SSL_read_ex(ssl_, out, size, &got) == 1) return {StreamStatus::kOk, got};
      const int error = ::SSL_get_error(ssl_, 0);
      if (error == SSL_ERROR_ZERO_RETURN) return {StreamStatus::kClosed, 0};
      if (error != SSL_ERROR_WANT_READ) {
        const bool refused = certificate_is_refused(::ERR_peek_error());
        why_ = refused ? "it refuses our certificate: " + last_error() : last_error();
        return {refused ? StreamStatus::kClosed : StreamStatus::kFailed, 0};
      }
      if (const auto status = flush(deadline); status != StreamStatus::kOk) return {status, 0};
      if (const auto status = fetch(deadline); status != StreamStatus::kOk) return {status, 0};
    }
  }

  StreamStatus send(const std::uint8_t* data, std::size_t size, Deadline deadline) override {
    std::size_t sent = 0;
    if (size > 0 && ::SSL_write_ex(ssl_, data, size, &sent) != 1) {
      why_ = last_error();
      return StreamStatus::kFailed;
    }
    return flush(deadline);
  }

  void came() override { plain_->came(); }
  void shut_down() override { plain_->shut_down(); }
  int descriptor() const override { return plain_->descriptor(); }
  std::string why() const override { return why_.empty() ? plain_->why() : why_; }

 private:
  StreamStatus flush(Deadline deadline) {
    char* data = nullptr;
    const long size = BIO_get_mem_data(::SSL_get_wbio(ssl_), &data);
    if (size <= 0) return StreamStatus::kOk;
    const auto status =
        plain_->send(reinterpret_cast<const std::uint8_t*>(data), static_cast<std::size_t>(size), deadline);
    BIO_reset(::SSL_get_wbio(ssl_));
    return status;
  }

  StreamStatus fetch(Deadline deadline) {
    std::array<std::uint8_t, 16384> buffer;
    const Received got = plain_->receive(buffer.data(), buffer.size(), deadline);
    if (got.status != StreamStatus::kOk) return got.status;
    ::BIO_write(::SSL_get_rbio(ssl_), buffer.data(), static_cast<int>(got.bytes));
    return StreamStatus::kOk;
  }

  std::unique_ptr<Stream> plain_;
  std::shared_ptr<const TlsContext> context_;
  SSL* ssl_;
  std::string why_;
};

}  // namespace

Result<std::shared_ptr<const TlsContext>> tls_context(const TlsFiles& files, bool server) {
  for (const auto& [name, file] :
       {std::pair("authority", &files.authority), {"certificate", &files.certificate}, {"key", &files.key}}) {
    if (file->empty()) {
      return fail("rpc.tls",
                  fmt::format("tls:// needs three PEM files: authority, certificate, key; there is no {} (commands "
                              "take them from SENTREE_TLS_AUTHORITY, SENTREE_TLS_CERTIFICATE and SENTREE_TLS_KEY)",
                              name));
    }
  }
  auto context = std::make_shared<TlsContext>(server);
  SSL_CTX* c = context->get();
  const auto wrong = [](const std::string& what, const std::string& file) {
    return fail("rpc.tls", fmt::format("{} \"{}\" cannot be used: {}", what, file, last_error()));
  };
  ::SSL_CTX_set_min_proto_version(c, TLS1_2_VERSION);
  ::SSL_CTX_set_verify(c, SSL_VERIFY_PEER | SSL_VERIFY_FAIL_IF_NO_PEER_CERT, nullptr);
  ::SSL_CTX_set_mode(c, SSL_MODE_RELEASE_BUFFERS);
  // Without session tickets a server writes nothing behind the handshake that an idle client would have to read.
  ::SSL_CTX_set_num_tickets(c, 0);
  ::SSL_CTX_set_session_cache_mode(c, SSL_SESS_CACHE_OFF);
  if (::SSL_CTX_load_verify_file(c, files.authority.c_str()) != 1) return wrong("the authority", files.authority);
  if (::SSL_CTX_use_certificate_chain_file(c, files.certificate.c_str()) != 1)
    return wrong("the certificate", files.certificate);
  if (::SSL_CTX_use_PrivateKey_file(c, files.key.c_str(), SSL_FILETYPE_PEM) != 1) return wrong("the key", files.key);
  if (::SSL_CTX_check_private_key(c) != 1)
    return wrong("the key does not belong to the certificate; the key", files.key);
  return std::shared_ptr<const TlsContext>(std::move(context));
}

Result<void> check_dates(const TlsContext& context, const TlsFiles& files) {
  const ::X509* const shown = ::SSL_CTX_get0_certificate(context.get());
  const auto text = [](const ASN1_TIME* time) {
    const std::unique_ptr<BIO, decltype(&::BIO_free)> out(::BIO_new(::BIO_s_mem()), &::BIO_free);
    ::ASN1_TIME_print(out.get(), time);
    char* data = nullptr;
    const long size = BIO_get_mem_data(out.get(), &data);
    return std::string(data, static_cast<std::size_t>(size));
  };
  const auto wrong = [&](const char* what, const ASN1_TIME* time) {
    return fail("rpc.tls",
                fmt::format("the certificate \"{}\" {} {}, so that everybody would refuse it; issue a new one "
                            "(docs/how-to/certificates.md), or set this machine's clock",
                            files.certificate, what, text(time)));
  };
  const ASN1_TIME* const begins = ::X509_get0_notBefore(shown);
  const ASN1_TIME* const ends = ::X509_get0_notAfter(shown);
  if (::X509_cmp_current_time(begins) > 0) return wrong("is not valid before", begins);
  if (::X509_cmp_current_time(ends) < 0) return wrong("has expired at", ends);
  return {};
}

Result<Certificate> examine(const TlsFiles& files) {
  const auto context = tls_context(files, true);
  if (!context) return tl::unexpected(context.error());
  SSL_CTX* c = (*context)->get();
  ::X509* shown = ::SSL_CTX_get0_certificate(c);
  STACK_OF(X509)* chain = nullptr;
  SSL_CTX_get_extra_chain_certs(c, &chain);

  const std::unique_ptr<X509_STORE_CTX, decltype(&::X509_STORE_CTX_free)> check(::X509_STORE_CTX_new(),
                                                                                &::X509_STORE_CTX_free);
  if (::X509_STORE_CTX_init(check.get(), ::SSL_CTX_get_cert_store(c), shown, chain) != 1 ||
      ::X509_verify_cert(check.get()) != 1) {
    return fail("rpc.tls", "the certificate \"" + files.certificate + "\" will be refused: " +
                               ::X509_verify_cert_error_string(::X509_STORE_CTX_get_error(check.get())));
  }
  Certificate certificate;
  int seconds = 0;
  ::ASN1_TIME_diff(&certificate.days_left, &seconds, nullptr, ::X509_get0_notAfter(shown));
  if (const int at = ::X509_get_ext_by_NID(shown, NID_subject_alt_name, -1); at >= 0) {
    const std::unique_ptr<BIO, decltype(&::BIO_free)> text(::BIO_new(::BIO_s_mem()), &::BIO_free);
    ::X509V3_EXT_print(text.get(), ::X509_get_ext(shown, at), 0, 0);
    char* data = nullptr;
    const long size = BIO_get_mem_data(text.get(), &data);
    certificate.names.assign(data, static_cast<std::size_t>(size));
  }
  return certificate;
}

Connected tls_stream(std::unique_ptr<Stream> plain, const std::shared_ptr<const TlsContext>& context,
                     const std::string& host, Deadline deadline) {
  auto stream = std::make_unique<TlsStream>(std::move(plain), context);
  const StreamStatus status = stream->handshake(host, deadline);
  if (status == StreamStatus::kOk) return {std::move(stream), status, {}};
  std::string why = "TLS: " + (status == StreamStatus::kLate ? "the handshake took too long" : stream->why());
  return {nullptr, status, std::move(why)};
}

}  // namespace sentree::rpc
