/** What an address of the class holds behind '#'. The studio doesn't import this file: its links hold projects there. */

const CODE = /^[0-9A-Za-z]{6}$/;

/**
 * The secret in the part of an address behind '#': the code of the class at `/join`, from a QR code; the key of a teacher
 * without a password at `/teacher`. Empty for anything else: the server sends who opens a shared link without a session to
 * `/join`, and browsers keep what stands behind '#'.
 */
export function secretOf(path: string, behind: string): string {
  if (path === "/teacher") return behind;
  return CODE.test(behind) ? behind : "";
}

/** The secret of this page's address. It is taken out of the address, so that no shared link and no history holds it. */
export const secretInAddress = takeSecret();

// Another secret on the same page, as from a QR code that is scanned again, begins anew.
window.addEventListener("hashchange", () => secretOf(location.pathname, location.hash.slice(1)) && location.reload());

function takeSecret(): string {
  const secret = secretOf(location.pathname, location.hash.slice(1));
  if (secret) history.replaceState(null, "", location.pathname + location.search);
  return secret;
}
