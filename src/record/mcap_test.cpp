#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "sentree/base/rng.h"
#include "sentree/record/compression.h"
#include "sentree/record/reader.h"
#include "sentree/record/recorder.h"
#include "sentree/record/writer.h"

namespace sentree::record {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::SizeIs;

struct Written {
  std::vector<RawMessage> messages;  // in the order written
  std::deque<std::string> data;      // which `messages` borrow
  std::vector<Attachment> attachments;
  std::vector<Metadata> metadata;
  std::string file;
  std::size_t data_end = 0;  // where the summary begins
};

std::string random_text(Rng& rng, std::size_t size_max) {
  std::string text(rng.below(size_max + 1), ' ');
  for (char& c : text) c = static_cast<char>(rng.below(256));
  return text;
}

// Messages of several channels in several chunks, with attachments and metadata between them.
Written write_random(std::uint64_t seed, Compression compression) {
  Rng rng(seed);
  Written written;
  StringSink sink(written.file);
  Writer writer(sink, compression);
  EXPECT_TRUE(writer.begin("", "test"));
  std::vector<Schema> schemas{{1, "a", "jsonschema", "{}"}, {2, "b", "jsonschema", random_text(rng, 50)}};
  std::vector<Channel> channels;
  for (ChannelId id = 1; id <= 4; ++id)
    channels.push_back({id, static_cast<SchemaId>(id % 3), "/" + std::to_string(id), "json", {{"k", "v"}}});
  std::uint64_t time = 0;
  const std::uint64_t chunks = 1 + rng.below(6);
  for (std::uint64_t c = 0; c < chunks; ++c) {
    Chunk chunk;
    if (c == 0) {
      for (const Schema& schema : schemas) chunk.add(schema);
      for (const Channel& channel : channels) chunk.add(channel);
    }
    const std::uint64_t count = rng.below(40);
    for (std::uint64_t i = 0; i < count; ++i) {
      time += rng.below(3);
      written.data.push_back(random_text(rng, 300));
      const RawMessage message{static_cast<ChannelId>(1 + rng.below(4)), static_cast<std::uint32_t>(i), time, time,
                               written.data.back()};
      chunk.add(message);
      written.messages.push_back(message);
    }
    EXPECT_TRUE(writer.write(chunk));
    if (rng.below(2) == 0) {
      written.attachments.push_back({time, 0, random_text(rng, 9), "text/plain", random_text(rng, 900)});
      EXPECT_TRUE(writer.write(written.attachments.back()));
    }
    if (rng.below(2) == 0) {
      written.metadata.push_back({"m" + std::to_string(c), {{"key", random_text(rng, 20)}}});
      EXPECT_TRUE(writer.write(written.metadata.back()));
    }
  }
  written.data_end = written.file.size();
  EXPECT_TRUE(writer.end(schemas, channels));
  return written;
}

std::unique_ptr<Reader> open(std::string_view file) {
  auto reader = Reader::open(std::make_unique<StringSource>(file), "test.mcap");
  EXPECT_TRUE(reader.has_value()) << to_string(reader.error());
  return reader ? std::move(*reader) : nullptr;
}

struct Read {
  RawMessage head;
  std::string data;
};
std::vector<Read> read_all(Reader& reader, const Query& query = {}) {
  std::vector<Read> messages;
  EXPECT_TRUE(reader.read(query, [&](const RawMessage& message) {
    messages.push_back({message, std::string(message.data)});
    return true;
  }));
  return messages;
}

void expect_same(const RawMessage& written, const Read& read) {
  EXPECT_EQ(written.channel, read.head.channel);
  EXPECT_EQ(written.sequence, read.head.sequence);
  EXPECT_EQ(written.log_time, read.head.log_time);
  EXPECT_EQ(written.data, read.data);
}

TEST(Mcap, ReadsBackWhatWasWritten) {
  for (const Compression compression : {Compression::kNone, Compression::kLz4, Compression::kZstd}) {
    for (std::uint64_t seed = 1; seed <= 60; ++seed) {
      SCOPED_TRACE("seed " + std::to_string(seed) + " compression " + std::string(to_string(compression)));
      const Written written = write_random(seed, compression);
      const auto reader = open(written.file);
      ASSERT_NE(reader, nullptr);
      EXPECT_TRUE(reader->complete());
      EXPECT_EQ(reader->library(), "test");
      EXPECT_EQ(reader->statistics().messages, written.messages.size());
      const auto messages = read_all(*reader);
      EXPECT_THAT(reader->problems(), SizeIs(0));
      ASSERT_EQ(messages.size(), written.messages.size());
      for (std::size_t i = 0; i < messages.size(); ++i) expect_same(written.messages[i], messages[i]);
      ASSERT_EQ(reader->attachments().size(), written.attachments.size());
      for (std::size_t i = 0; i < written.attachments.size(); ++i)
        EXPECT_EQ(*reader->attachment(reader->attachments()[i]), written.attachments[i]);
      ASSERT_EQ(reader->metadata().size(), written.metadata.size());
      for (std::size_t i = 0; i < written.metadata.size(); ++i)
        EXPECT_EQ(*reader->metadata(reader->metadata()[i]), written.metadata[i]);
    }
  }
}

TEST(Mcap, FindsMessagesByChannelAndTime) {
  const Written written = write_random(7, Compression::kZstd);
  const auto reader = open(written.file);
  const std::uint64_t from = written.messages[written.messages.size() / 4].log_time;
  const std::uint64_t to = written.messages[written.messages.size() / 2].log_time;
  std::vector<RawMessage> expected;
  for (const RawMessage& message : written.messages) {
    if (message.channel == 2 && message.log_time >= from && message.log_time <= to) expected.push_back(message);
  }
  const auto messages = read_all(*reader, {.channels = reader->channels_of("/2"), .from = from, .to = to});
  ASSERT_EQ(messages.size(), expected.size());
  for (std::size_t i = 0; i < messages.size(); ++i) expect_same(expected[i], messages[i]);
}

TEST(Mcap, CutOffAnywhereGivesWhatWasWrittenBefore) {
  for (std::uint64_t seed = 1; seed <= 12; ++seed) {
    const Written written = write_random(seed, seed % 2 == 0 ? Compression::kZstd : Compression::kNone);
    Rng rng(seed);
    for (int i = 0; i < 60; ++i) {
      const std::size_t size = kMagic.size() + rng.below(written.file.size() - kMagic.size());
      SCOPED_TRACE("seed " + std::to_string(seed) + " cut at " + std::to_string(size));
      const auto reader = open(std::string_view(written.file).substr(0, size));
      ASSERT_NE(reader, nullptr);
      EXPECT_FALSE(reader->complete());
      EXPECT_THAT(reader->problems(), SizeIs(1));
      const auto messages = read_all(*reader);
      ASSERT_LE(messages.size(), written.messages.size());
      for (std::size_t k = 0; k < messages.size(); ++k) expect_same(written.messages[k], messages[k]);
      if (size >= written.data_end) {
        EXPECT_EQ(messages.size(), written.messages.size());
      }
    }
  }
}

TEST(Mcap, DamageLosesItsChunkOnly) {
  const Written written = write_random(3, Compression::kNone);
  std::string file = written.file;
  const auto whole = open(written.file);
  file[file.size() / 3] ^= 0x40;
  const auto reader = open(file);
  ASSERT_NE(reader, nullptr);
  const auto messages = read_all(*reader);
  EXPECT_LT(messages.size(), written.messages.size());
  EXPECT_GT(messages.size(), 0u);
  ASSERT_THAT(reader->problems(), SizeIs(1));
  EXPECT_EQ(reader->problems()[0].code, "record.damaged-chunk");
}

TEST(Mcap, ReadsMessagesOutsideOfChunks) {
  // As a writer without chunks makes it: the records of one lie in the file themselves.
  Chunk records;
  records.add(Channel{1, 0, "/a", "json", {}});
  records.add(RawMessage{1, 1, 20, 20, "{}"});
  records.add(RawMessage{1, 2, 10, 10, "[]"});
  std::string file;
  StringSink sink(file);
  Writer writer(sink, Compression::kNone);
  ASSERT_TRUE(writer.begin("", "test"));
  ASSERT_TRUE(sink.write(records.records));
  const auto reader = open(file);
  const auto messages = read_all(*reader);
  ASSERT_THAT(messages, SizeIs(2));
  EXPECT_EQ(messages[0].data, "[]");
  EXPECT_EQ(reader->statistics().messages, 2u);
}

TEST(Mcap, MergesChunksThatOverlapInTime) {
  std::string file;
  StringSink sink(file);
  Writer writer(sink);
  ASSERT_TRUE(writer.begin("", "test"));
  const Channel channel{1, 0, "/a", "json", {}};
  for (std::uint64_t c = 0; c < 3; ++c) {
    Chunk chunk;
    chunk.add(channel);
    for (std::uint64_t i = 0; i < 4; ++i) chunk.add(RawMessage{1, 0, i * 10 + c, 0, ""});
    ASSERT_TRUE(writer.write(chunk));
  }
  ASSERT_TRUE(writer.end({}, {channel}));
  std::vector<std::uint64_t> times;
  for (const Read& message : read_all(*open(file))) times.push_back(message.head.log_time);
  EXPECT_THAT(times, ElementsAre(0, 1, 2, 10, 11, 12, 20, 21, 22, 30, 31, 32));
}

TEST(Mcap, RefusesWhatIsNone) {
  EXPECT_EQ(Reader::open(std::make_unique<StringSource>("<root/>"), "x").error().code, "record.not-mcap");
  EXPECT_EQ(Reader::open("/nonexistent.mcap").error().code, "file.not-found");
}

TEST(Compression, BoundsWhatAFewBytesMayAskFor) {
  for (const std::string_view name : {"lz4", "zstd"}) {
    EXPECT_FALSE(decompress(name, "abc", std::size_t{1} << 27U).has_value());
  }
  EXPECT_EQ(decompress("bz2", "", 0).error().code, "record.compression");
}

TEST(Compression, RefusesAnotherSize) {
  for (const Compression compression : {Compression::kNone, Compression::kLz4, Compression::kZstd}) {
    std::string packed;
    compress(compression, std::string(1000, 'x'), packed);
    EXPECT_TRUE(decompress(to_string(compression), packed, 1000).has_value());
    EXPECT_FALSE(decompress(to_string(compression), packed, 999).has_value());
    EXPECT_FALSE(decompress(to_string(compression), packed, 1001).has_value());
  }
}

TEST(Reader, RefusesRecordsThatAreTooLarge) {
  const Written written = write_random(3, Compression::kNone);
  auto reader = Reader::open(std::make_unique<StringSource>(written.file), "test.mcap");
  ASSERT_TRUE(reader.has_value());
  const auto code = [](const auto& result) { return result ? "read" : result.error().code; };
  // As large as is read, they are looked for and not found there.
  EXPECT_EQ(code((*reader)->attachment({.length = kRecordSizeMax, .name = "a"})), "record.damaged");
  EXPECT_EQ(code((*reader)->attachment({.length = kRecordSizeMax + 1, .name = "a"})), "record.too-large");
  EXPECT_EQ(code((*reader)->metadata({.length = kRecordSizeMax, .name = "m"})), "record.damaged");
  EXPECT_EQ(code((*reader)->metadata({.length = kRecordSizeMax + 1, .name = "m"})), "record.too-large");
}

// A chunk record as it lies in a file, unpacked; `size` is what it says of itself.
std::string chunk_record(std::string_view records, std::uint64_t size) {
  std::string content;
  const auto put = [](std::string& to, std::uint64_t value, int bytes) {
    for (int i = 0; i < bytes; ++i) to += static_cast<char>(value >> (8 * i));
  };
  put(content, 0, 8);
  put(content, 0, 8);
  put(content, size, 8);
  put(content, 0, 4);  // no checksum
  put(content, 0, 4);  // no compression
  put(content, records.size(), 8);
  content += records;
  std::string record(1, static_cast<char>(Op::kChunk));
  put(record, content.size(), 8);
  return record + content;
}

// A file of nothing but one record again and again: far larger than what is held of it.
class RepeatedSource final : public Source {
 public:
  RepeatedSource(std::string record, std::uint64_t times) : record_(std::move(record)), times_(times) {}
  std::uint64_t size() const override { return kMagic.size() + record_.size() * times_; }
  Result<std::string> read(std::uint64_t offset, std::uint64_t length) override {
    std::string bytes;
    for (const std::uint64_t end = std::min(size(), offset + length); offset < end; ++offset)
      bytes += offset < kMagic.size() ? kMagic[offset] : record_[(offset - kMagic.size()) % record_.size()];
    return bytes;
  }

 private:
  std::string record_;
  std::uint64_t times_;
};

std::string open_repeated(const std::string& record, std::uint64_t times) {
  const auto reader = Reader::open(std::make_unique<RepeatedSource>(record, times), "many.mcap");
  return reader ? std::to_string((*reader)->statistics().chunks) + " chunks" : reader.error().code;
}

TEST(Reader, TakesAsManyChunksAsItSaysAndNoMore) {
  const std::string empty = chunk_record("", 0);
  EXPECT_EQ(open_repeated(empty, kChunksMax), std::to_string(kChunksMax) + " chunks");
  EXPECT_EQ(open_repeated(empty, kChunksMax + 1), "record.too-large");
}

TEST(Reader, UnpacksChunksOfTheSizeItSaysAndNoLarger) {
  const auto problem = [](std::uint64_t size) {
    const auto reader = Reader::open(std::make_unique<RepeatedSource>(chunk_record("", size), 1), "large.mcap");
    return reader ? (*reader)->problems().front().message : reader.error().message;
  };
  // One that may be unpacked turns out not to be what it says.
  EXPECT_THAT(problem(kChunkSizeMax), Not(HasSubstr("too large")));
  EXPECT_THAT(problem(kChunkSizeMax + 1), HasSubstr("too large"));
}

TEST(Reader, UnpacksSoManyTimesTheFileAndNoMore) {
  const auto problem = [](std::uint64_t chunks) {
    const auto reader =
        Reader::open(std::make_unique<RepeatedSource>(chunk_record("", kChunkSizeMax), chunks), "b.mcap");
    return reader ? (*reader)->problems()[chunks - 1].message : reader.error().message;
  };
  EXPECT_THAT(problem(kUnpackedMax / kChunkSizeMax), HasSubstr("cannot be unpacked"));
  EXPECT_THAT(problem(kUnpackedMax / kChunkSizeMax + 1), HasSubstr("more than 250 times"));
}

TEST(Reader, TakesMessagesOutsideOfChunksInPieces) {
  const auto parts = [](std::size_t data) {
    Chunk records;
    records.add(Channel{1, 0, "/a", "json", {}});
    const std::size_t head = records.records.size();
    const std::string half(data / 2 - kRecordHeaderSize - kMessageHeaderSize, ' ');
    records.add(RawMessage{1, 1, 10, 10, half});
    records.add(RawMessage{1, 2, 20, 20, std::string_view(half).substr(head)});
    const std::string file = std::string(kMagic) + records.records;
    const auto reader = open(file);
    EXPECT_THAT(read_all(*reader), SizeIs(2));
    return reader->parts();
  };
  EXPECT_EQ(parts(kLooseSizeMax), 1u);
  EXPECT_EQ(parts(kLooseSizeMax + 2), 2u);
}

TEST(Reader, KeepsAsManyProblemsAsItSays) {
  const auto reader =
      Reader::open(std::make_unique<RepeatedSource>(chunk_record("no record", 9), 2 * kReaderProblemsMax), "bad.mcap");
  ASSERT_TRUE(reader.has_value());
  EXPECT_THAT((*reader)->problems(), SizeIs(kReaderProblemsMax));
}

TEST(Reader, HoldsOverlappingChunksUpToABound) {
  std::string file;
  StringSink sink(file);
  Writer writer(sink);
  ASSERT_TRUE(writer.begin("", "test"));
  const Channel channel{1, 0, "/a", "json", {}};
  std::uint64_t held = 0;
  for (int c = 0; c < 3; ++c) {
    Chunk chunk;
    chunk.add(channel);
    chunk.add(RawMessage{1, 0, 0, 0, ""});
    chunk.add(RawMessage{1, 1, 10, 10, ""});
    held += chunk.records.size();
    ASSERT_TRUE(writer.write(chunk));
  }
  ASSERT_TRUE(writer.end({}, {channel}));
  const auto code = [&](std::uint64_t overlap_max) {
    const auto read = open(file)->read({.overlap_max = overlap_max}, [](const RawMessage&) { return true; });
    return read ? "read" : read.error().code;
  };
  EXPECT_EQ(code(held), "read");
  EXPECT_EQ(code(held - 1), "record.overlap");
  EXPECT_EQ(Query().overlap_max, kOverlapMax);
}

}  // namespace
}  // namespace sentree::record
